// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "server/synthesis/schedule/mixer_event.h"

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

/// Sets the time of `event`: `frames`, zero or more, since the mixer began.
inline void SetFrame(MixerEvent& event, double frames) {
  const double whole = std::floor(frames);
  event.frame = static_cast<uint64_t>(whole);
  // The cast may round 1 - 1e-9 up to 1.
  event.fraction = std::fmin(static_cast<float>(frames - whole), 0x1.fffffep-1F);
}

}  // namespace carillon
