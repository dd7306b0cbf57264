// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "client_sdk/motion/kinematics.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// The frames in which a body falls freely.
struct FreeFall {
  size_t frame_count = 0;  ///< in falls of three frames or more
  size_t frame = 0;        ///< the middle of the longest of these falls
};

/// Finds the frames in which a body falls with `factor` times gravity.
FreeFall FindFreeFall(const BodyMotion& body, const Motion& motion, double factor);

/// The lengths of poses that gravity does not fit.
struct LengthMistake {
  double factor = 1;  ///< by which the poses are too large; 1 if there is no mistake
  size_t body = 0;    ///< that falls so much too fast
};

/// Finds bodies that fall 100 or 1000 times too fast or too slowly, where none falls as it should.
/// Then the poses are in another unit of length than metres.
LengthMistake FindLengthMistake(const Motion& motion);

}  // namespace carillon::motion
