// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "absl/status/status.h"

namespace carillon {

/// A point on a triangle: barycentric weights of its three vertices.
struct SurfacePoint {
  uint32_t triangle = 0;
  std::array<double, 3> weights{1, 0, 0};
};

/// A point in space, metres.
using Point = std::array<double, 3>;

/// An impulse on one object, all in the object's frame (and size).
struct ContactImpulse {
  /// Where: a point, or a point on a triangle of the surface as given.
  std::variant<Point, SurfacePoint> location;
  std::array<double, 3> impulse_newton_seconds{};
  double duration_s = 0;
};

/// The longest contact.
inline constexpr double kLongestContactS = 0.1;

/// INVALID_ARGUMENT (POINT_NOT_FINITE).
absl::Status ValidatePoint(const Point& point);

/// INVALID_ARGUMENT (INVALID_WEIGHTS).
absl::Status ValidateWeights(const std::array<double, 3>& weights);

/// INVALID_ARGUMENT with IMPULSE_NOT_FINITE, POINT_NOT_FINITE, INVALID_DURATION or INVALID_WEIGHTS.
absl::Status Validate(const ContactImpulse& contact);

/// Standard deviation of the Gaussian over which a contact of this duration spreads its impulse.
inline double GaussianTauS(double duration_s) { return duration_s / 4; }

}  // namespace carillon
