// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "server/synthesis/lane_arrays.h"

namespace carillon {

/// Blocks are no longer than this: single-precision coefficients drift from the double state within
/// a block.
inline constexpr size_t kMostBlockFrames = 256;

/// One block of sound, still split into the lanes of a vector: all banks add to it, and the lanes
/// are summed once for all of them.
class LaneMix {
 public:
  /// Silences the first `frame_count` frames.
  void Clear(size_t frame_count) noexcept;

  /// Writes the sum of each frame's lanes into `block`.
  void Reduce(std::span<float> block) const noexcept;

  /// Frame n is lanes()[n * kMostLanes] and the kMostLanes - 1 floats after it.
  float* lanes() noexcept { return lanes_.data(); }

 private:
  alignas(64) std::array<float, kMostBlockFrames * kMostLanes> lanes_;
};

}  // namespace carillon
