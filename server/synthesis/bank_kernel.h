// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "server/synthesis/lane_arrays.h"

namespace carillon {

/// The inner loops of an oscillator bank, compiled for every SIMD target and dispatched at run
/// time. Lane counts are multiples of kMostLanes. None allocates, locks or throws.
namespace bank_kernel {

/// Adds the first `lane_count` lanes' samples [0, frame_count) to `mix` (frame n at
/// mix[n * kMostLanes]), from the state at the start of the block, which stays.
void Ring(const LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) noexcept;

/// The same from the newborn state, which is advanced by `frame_count`.
void RingNewborn(LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) noexcept;

/// What Advance found.
struct Advanced {
  size_t awake_lane_count = 0;  ///< all lanes beyond are silent
  bool finite = true;
};

/// Advances the first `lane_count` lanes by a block; with `newborn`, adds the newborn state, which
/// it clears. Groups of kMostLanes lanes below -140 dB of full scale are silenced.
Advanced Advance(LaneArrays& lanes, size_t lane_count, bool newborn) noexcept;

/// A strike as the kernel needs it.
struct Projection {
  /// For each vertex and axis: the row of the shape table from the first column projected, and
  /// weight times impulse.
  std::array<const float*, 9> rows{};
  std::array<float, 9> factors{};
  size_t column_count = 0;
  float lead_frames = 0;
  float tau_s = 0;
};

/// Projects a strike onto the modes and adds it to the newborn state. False: not finite, and
/// nothing was added.
bool Excite(const Projection& projection, LaneArrays& lanes, size_t lane_count) noexcept;

/// Name of the target dispatched to.
std::string_view Target();

}  // namespace bank_kernel
}  // namespace carillon
