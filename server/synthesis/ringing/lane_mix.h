// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/node_mix.h"

namespace carillon {

/// One block of sound that all banks add to. Most of the sound is stored as sums in separate SIMD
/// lanes, and as values at the Chebyshev nodes of longer tiles (tile.h). Both become samples once
/// for all banks.
class LaneMix {
 public:
  /// Silences the first `frame_count` frames. Only what is used after it costs anything.
  void Clear(size_t frame_count) noexcept;

  /// Writes the sum of all added sound to `block`, which has the cleared number of frames.
  void Reduce(std::span<float> block) noexcept;

  /// Frame n is lanes()[n * kMostLanes] and the kMostLanes - 1 floats after it.
  float* lanes() noexcept;

  /// Nodes of the tiles that begin with the block.
  NodeMix& nodes() noexcept { return nodes_; }

  /// Samples that are not split into lanes; readable to the end of a vector.
  float* frames() noexcept;

 private:
  size_t frame_count_ = 0;
  bool uses_lanes_ = false, uses_frames_ = false;
  alignas(64) std::array<float, kMostBlockFrames * kMostLanes> lanes_;
  alignas(64) std::array<float, kMostBlockFrames + kMostLanes> frames_;
  NodeMix nodes_;
};

}  // namespace carillon
