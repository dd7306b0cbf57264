// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
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

/// A collision of an object with an elastic striker.
struct HertzContact {
  double reduced_mass_kg = 0;
  double reduced_radius_m = 0;
  double approach_speed_m_per_s = 0;
  /// Young's modulus of the striker; zero: the striker's modulus and Poisson's ratio equal the
  /// object's.
  double striker_young_pa = 0;
  double striker_poisson_ratio = 0;
};

/// An impulse or a force on one object, in the object's frame and at its size.
struct ContactImpulse {
  /// A point in space, or a point on a triangle of the surface as given.
  std::variant<Point, SurfacePoint> location;
  std::array<double, 3> impulse_newton_seconds{};  ///< newtons if this is a force
  double duration_s = 0;
  /// If it is given, it determines the duration.
  std::optional<HertzContact> hertz = std::nullopt;
};

/// The fluctuation of a contact's force while the contact travels over a rough surface.
struct Roughness {
  double travel_speed_m_per_s = 0;
  double depth = 0;        ///< root mean square of the fluctuation, relative to the force
  double grain_m = 0.001;  ///< distance between bumps of the surface
};

/// Longer contacts are refused.
inline constexpr double kLongestContactS = 0.1;

/// INVALID_ARGUMENT (POINT_NOT_FINITE).
absl::Status ValidatePoint(const Point& point);

/// INVALID_ARGUMENT (INVALID_WEIGHTS).
absl::Status ValidateWeights(const std::array<double, 3>& weights);

/// INVALID_ARGUMENT with IMPULSE_NOT_FINITE, POINT_NOT_FINITE, INVALID_DURATION,
/// INVALID_HERTZ_CONTACT or INVALID_WEIGHTS.
absl::Status Validate(const ContactImpulse& contact);

/// INVALID_ARGUMENT (INVALID_ROUGHNESS).
absl::Status Validate(const Roughness& roughness);

/// The time for which the bodies touch, seconds (Johnson, Contact Mechanics, 11.4):
///
///   T = 2.87 (m^2 / (R E^2 v))^(1/5),  1/E = (1 - nu1^2)/E1 + (1 - nu2^2)/E2
///
/// for an object of Young's modulus `young_pa` and Poisson's ratio `poisson_ratio`.
double HertzDurationS(const HertzContact& contact, double young_pa, double poisson_ratio);

/// Standard deviation of the Gaussian in time over which a contact of this duration spreads its
/// impulse.
inline double GaussianTauS(double duration_s) { return duration_s / 4; }

}  // namespace carillon
