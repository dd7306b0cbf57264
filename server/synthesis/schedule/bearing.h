// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace carillon {

/// The direction and distance of the listener, seen from an object.
struct Bearing {
  std::array<double, 3> direction{0, 0, 1};  ///< unit vector in the object's frame
  double distance_m = 1;
};

}  // namespace carillon
