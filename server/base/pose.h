// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "absl/status/status.h"

namespace carillon {

using Vector3 = std::array<double, 3>;

/// A rotation, of unit length.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
};

/// Where a body is in its scene's space.
struct Pose {
  Vector3 position_m{};      ///< the origin of its frame
  Quaternion orientation{};  ///< turns a vector of its frame into one of the scene's
};

/// INVALID_ARGUMENT (INVALID_POSE: not finite, beyond 1e6 m, or a quaternion that is not of unit
/// length to 1e-3).
absl::Status Validate(const Pose& pose);
absl::Status Validate(const Quaternion& rotation);

/// Of exactly unit length.
Quaternion Normalized(const Quaternion& q);

Quaternion Inverse(const Quaternion& q);

/// First `b`, then `a`.
Quaternion Product(const Quaternion& a, const Quaternion& b);

Vector3 Rotated(const Vector3& v, const Quaternion& q);

}  // namespace carillon
