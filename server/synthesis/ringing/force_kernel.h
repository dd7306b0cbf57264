// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/ring_kernel.h"
#include "server/synthesis/ringing/strike_kernel.h"

namespace carillon {

/// The arrays of a sustained force on one bank. Columns are those that impulses are projected onto;
/// lanes are those of LaneArrays.
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

  /// Sets all but the kinks to zero.
  void Clear() noexcept;

  size_t lane_count, column_count;
  /// Modal forces by column: the sum so far for the next knot, the force at the last knot, its
  /// slope (1/s) before the last knot, and the change of slope at the last knot.
  LaneArray<float> next, last, slope, jump;
  /// Change of the state by a unit change of slope: gain exp(s^2 tau^2/2) / s^2.
  LaneArray<float> kink_re, kink_im;
  /// Change of the state by a unit of noise in one sample. It goes from `from` to `to` within one
  /// step; `to` follows the force at the last knot.
  LaneArray<float> from_re, from_im, to_re, to_im;
};

/// The inner loops of sustained forces, compiled for every SIMD target and dispatched at run time.
/// None allocates, locks or throws.
namespace force_kernel {

/// next += the modal forces of one contact.
void AddForce(const strike_kernel::Projection& projection, float* next) noexcept;

/// Ends a step of length 1 / rate_hz: sets slope and jump, moves next to last and clears next.
/// Returns false if a force was not finite; all forces are then zero.
bool EndStep(float rate_hz, ForceArrays& force) noexcept;

/// Writes the changes of the states that the changes of slope in `jump` cause to added_re and
/// added_im.
void Kink(const ForceArrays& force, const LaneArrays& lanes, float* added_re,
          float* added_im) noexcept;

/// Starts a new stretch of the drive: from = the present drive, which is at `position` (0 to 1)
/// between from and to; to = last * scale.
void SetDrive(float position, float scale, const LaneArrays& lanes, ForceArrays& force) noexcept;

/// The drive of each sample: from * from_share[n] + to * to_share[n] is added to the states before
/// sample n.
struct Drive {
  const float* from_share = nullptr;
  const float* to_share = nullptr;
  size_t frame_count = 0;
};

/// The buffer that the driven lanes are rendered to, frame by frame, and their gains.
struct DrivenOutput {
  float* mix = nullptr;
  ring_kernel::Gains gains{};
  /// A second rendering of the same states with other gains; null if there is none.
  float* second_mix = nullptr;
  ring_kernel::Gains second_gains{};
};

/// Adds the samples of all lanes to the output while driving the lanes, and advances the start and
/// fresh states (LaneArrays).
void RingDriven(const ForceArrays& force, const Drive& drive, LaneArrays& lanes,
                const DrivenOutput& output) noexcept;

}  // namespace force_kernel
}  // namespace carillon
