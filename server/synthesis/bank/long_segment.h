// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/ring_kernel.h"
#include "server/synthesis/spectrum/spectral_lanes.h"

namespace carillon {

/// The lanes of a bank that can ring by spectrum, in long blocks of one kind. Their states pass
/// from the time domain into the spectrum, and back, where a long block begins.
struct LongSegment {
  SpectralLanes lanes;
  size_t mode_count = 0;
  size_t block_count = 1;  ///< blocks of the mixer in a long block
  double loudest_squared = 0;
  bool awake = false;
  bool sounding = false;       ///< in the current long block
  bool struck = false;         ///< since the current long block began
  uint32_t struck_streak = 0;  ///< consecutive long blocks in which it was struck

  /// Adds the states of `from`, which is segment `index` of `time`, and silences `from`.
  void TakeFromTime(size_t index, RingingSegment& from, LaneArrays& time) noexcept;

  /// Adds its states to `to`, which is segment `index` of `time`, and is silent then. Without
  /// effect if it does not ring.
  void GiveToTime(size_t index, RingingSegment& to, LaneArrays& time) noexcept;

  void Silence() noexcept;

  /// Multiplies all amplitudes by `factor`.
  void Scale(double factor) noexcept;
};

}  // namespace carillon
