// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/node_mix.h"

namespace carillon {

/// One block of sound, all but some of it still split into the lanes of a vector: all banks add to
/// it, and lanes and nodes are summed once for all of them.
class LaneMix {
 public:
  /// Silences the first `frame_count` frames.
  void Clear(size_t frame_count) noexcept;

  /// Writes the sum of all that was added into `block`, of as many frames.
  void Reduce(std::span<float> block) noexcept;

  /// Frame n is lanes()[n * kMostLanes] and the kMostLanes - 1 floats after it.
  float* lanes() noexcept { return lanes_.data(); }

  /// Tiles from the block's begin on.
  NodeMix& nodes() noexcept { return nodes_; }

  /// What is not split, up to the end of a vector.
  float* frames() noexcept { return frames_.data(); }

 private:
  alignas(64) std::array<float, kMostBlockFrames * kMostLanes> lanes_;
  alignas(64) std::array<float, kMostBlockFrames + kMostLanes> frames_;
  NodeMix nodes_;
};

}  // namespace carillon
