// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <span>

namespace carillon {

/// The widest vector of floats that any SIMD target uses; arrays over modes are padded to it.
inline constexpr size_t kMostLanes = 16;

/// Blocks are no longer than this: float coefficients drift away from the double state within one.
inline constexpr size_t kMostBlockFrames = 256;

/// One block of sound, still split into the lanes of a vector: all banks add to it, and the lanes
/// are summed once for all of them.
class LaneMix {
 public:
  /// Silences the first `frame_count` frames.
  void Clear(size_t frame_count) noexcept;
  /// Sums the lanes into `block`.
  void Reduce(std::span<float> block) const noexcept;
  /// Frame n is lanes()[n * kMostLanes] and the kMostLanes - 1 floats after it.
  float* lanes() noexcept { return lanes_.data(); }

 private:
  alignas(64) std::array<float, kMostBlockFrames * kMostLanes> lanes_;
};

}  // namespace carillon
