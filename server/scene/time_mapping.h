// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace carillon {

/// Maps simulation time to the frames of a mixer.
struct TimeMapping {
  uint64_t first_frame = 0;
  double first_time_s = 0;  ///< simulation time at that frame
  double delay_s = 0;

  /// frame(t) = first frame + (t - first time + delay) rate
  double FrameOf(double time_s, double sample_rate_hz) const {
    return static_cast<double>(first_frame) + (time_s - first_time_s + delay_s) * sample_rate_hz;
  }
};

}  // namespace carillon
