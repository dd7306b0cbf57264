// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "absl/status/status.h"

namespace carillon {

using Vector3 = std::array<double, 3>;

/// A rotation, of unit length.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;

  bool operator==(const Quaternion&) const = default;
};

/// Position and orientation of a body in its scene.
struct Pose {
  Vector3 position_m{};      ///< the origin of the body's frame
  Quaternion orientation{};  ///< rotates vectors of the body's frame into the scene's frame

  bool operator==(const Pose&) const = default;
};

/// Returns INVALID_ARGUMENT (INVALID_POSE) if a value is not finite, a coordinate exceeds 1e6 m, or
/// the quaternion's length differs from 1 by more than 1e-3.
absl::Status Validate(const Pose& pose);
absl::Status Validate(const Quaternion& rotation);

/// Returns the quaternion divided by its length.
Quaternion Normalized(const Quaternion& q);

Quaternion Inverse(const Quaternion& q);

/// Returns the rotation `b` followed by the rotation `a`.
Quaternion Product(const Quaternion& a, const Quaternion& b);

Vector3 Rotated(const Vector3& v, const Quaternion& q);

}  // namespace carillon
