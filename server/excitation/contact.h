// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "absl/status/status.h"
#include "server/excitation/hertz.h"

namespace carillon {

/// A point on a triangle: barycentric weights of its three vertices.
struct SurfacePoint {
  uint32_t triangle = 0;
  std::array<double, 3> weights{1, 0, 0};
};

/// A point in space, metres.
using Point = std::array<double, 3>;

/// An impulse or a force on one object, in the object's frame and at its size.
struct ContactImpulse {
  /// A point in space, or a point on a triangle of the surface as given.
  std::variant<Point, SurfacePoint> location;
  std::array<double, 3> impulse_newton_seconds{};  ///< newtons if the contact is a force
  /// If it is absent, the duration is that of the collision of two elastic bodies.
  std::optional<double> duration_s = std::nullopt;
  HertzContact hertz{};
  /// Perpendicular to the surfaces that touch, of any length; if it is zero, the impulse is.
  std::array<double, 3> normal{};
};

/// The fluctuation of a contact's force while the contact travels over a rough surface.
struct Roughness {
  double travel_speed_m_per_s = 0;
  double depth = 0;  ///< root mean square of the fluctuation, relative to the force
  double irregularity_length_m = 0.001;  ///< distance between bumps of the surface
};

/// Longer contacts are refused.
inline constexpr double kLongestContactS = 0.1;

/// Checks a point. Errors: INVALID_ARGUMENT (CONTACT_MALFORMED).
absl::Status ValidatePoint(const Point& point);

/// Checks weights. Errors: INVALID_ARGUMENT (CONTACT_MALFORMED).
absl::Status ValidateWeights(const std::array<double, 3>& weights);

/// Checks a contact. Errors: INVALID_ARGUMENT (CONTACT_MALFORMED).
absl::Status Validate(const ContactImpulse& contact);

/// Checks a roughness. Errors: INVALID_ARGUMENT (CONTACT_MALFORMED).
absl::Status Validate(const Roughness& roughness);

}  // namespace carillon
