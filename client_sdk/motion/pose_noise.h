// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// The noise of the poses of a motion, such as that of motion capture.
struct PoseNoise {
  /// Standard deviation of a coordinate of the surface of the body where it is greatest, m.
  double place_m = 0;
  /// How many frames apart poses must be so that their noise passes for no contact. They keep at
  /// least 20 frames a second, and turns that can be told.
  size_t frames_apart = 1;
  bool suffices = true;  ///< whether the noise of poses so far apart passes for no contact
};

/// Measures noise that is not correlated from frame to frame. A motion without such noise, which
/// has impulses and forces alone, gives zero, as do frames that cannot be taken farther apart.
PoseNoise MeasureNoise(const Motion& motion);

/// Leaves each n-th pose, and each n-th frame of a motion, the first one included.
void TakeEach(size_t n, std::vector<BodyPose>& poses);
void TakeEach(size_t n, Motion& motion);

}  // namespace carillon::motion
