// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/strike_kernel.h"

namespace carillon {

/// The arrays of a sustained force on one bank. Columns are those that strikes are projected onto,
/// lanes those of LaneArrays.
struct ForceArrays {
  ForceArrays(size_t lanes, size_t columns)
      : lane_count(lanes),
        column_count(columns),
        next(column_count),
        last(column_count),
        slope(column_count),
        jump(column_count),
        kink_re(lane_count),
        kink_im(lane_count),
        from_re(lane_count),
        from_im(lane_count),
        to_re(lane_count),
        to_im(lane_count) {}

  /// Zeroes all but the kinks.
  void Clear() noexcept;

  size_t lane_count, column_count;
  /// Modal forces: those gathered for the next knot, and those at the last; how fast they changed
  /// up to the last knot, each second, and by how much that changed there.
  LaneArray<float> next, last, slope, jump;
  /// What a change of slope by one adds to the state: gain exp(s^2 tau^2/2) / s^2.
  LaneArray<float> kink_re, kink_im;
  /// What a fluctuation by one adds to the state in one sample, at the last knot and at the next.
  LaneArray<float> from_re, from_im, to_re, to_im;
};

/// The inner loops of sustained forces, compiled for every SIMD target and dispatched at run time.
/// None allocates, locks or throws.
namespace force_kernel {

/// next += the modal forces of one contact.
void Gather(const strike_kernel::Projection& projection, float* next) noexcept;

/// Ends a step that lasted 1 / rate_hz: sets slope and jump, moves next to last and clears it.
/// False: a force was not finite, and all are zero now.
bool EndStep(float rate_hz, ForceArrays& force) noexcept;

/// What the kinks of `jump` add to the states, into added_re and added_im.
void Kink(const ForceArrays& force, const LaneArrays& lanes, float* added_re,
          float* added_im) noexcept;

/// from = where the drive stands, `position` (0 to 1) of the way to `to`; to = `last` times
/// `scale`.
void Aim(float position, float scale, const LaneArrays& lanes, ForceArrays& force) noexcept;

/// How the drive runs: before sample n the states grow by from * from_share[n] + to * to_share[n].
struct Drive {
  const float* from_share = nullptr;
  const float* to_share = nullptr;
  size_t frame_count = 0;
};

/// Adds the samples of all lanes to `mix` while driving them, as ring_kernel::RingStruck does for
/// strikes.
void RingDriven(const ForceArrays& force, const Drive& drive, LaneArrays& lanes,
                float* mix) noexcept;

}  // namespace force_kernel
}  // namespace carillon
