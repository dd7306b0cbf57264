// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace carillon {

/// The figures of a collision of two elastic bodies that a client states.
struct HertzContact {
  std::optional<double> reduced_mass_kg = std::nullopt;         ///< m, 1/m = 1/m1 + 1/m2
  std::optional<double> reduced_radius_m = std::nullopt;        ///< R, 1/R = 1/R1 + 1/R2
  std::optional<double> approach_speed_m_per_s = std::nullopt;  ///< v
  /// Figures of the striker, which replace those of a second object or of the steel tip.
  std::optional<double> striker_young_pa = std::nullopt;
  std::optional<double> striker_poisson_ratio = std::nullopt;
  std::optional<double> striker_mass_kg = std::nullopt;
  /// Whether striker_mass_kg is that of the catalogue's entry, which the client only named.
  bool striker_mass_is_named = false;
  std::optional<double> striker_radius_m = std::nullopt;
};

/// One of two bodies that collide.
struct ElasticBody {
  double young_pa = 0;
  double poisson_ratio = 0;
  double mass_kg = 0;
  double curvature_per_m = 0;  ///< mean curvature at the point of contact; negative if hollow
};

/// The tip of a steel hammer of 20 g with a radius of 5 mm, the entry "steel" of
/// proto/strikers.textproto. It is the default striker.
inline constexpr ElasticBody kSteelTip{
    .young_pa = 2.06e11, .poisson_ratio = 0.29, .mass_kg = 0.02, .curvature_per_m = 200};

/// Largest radius of curvature of two surfaces that touch. Real faces are not plane, and meet at an
/// edge or at a bump.
inline constexpr double kFlattestRadiusM = 0.05;

/// Returns the reduced mass of the bodies, kg, or the one that is stated.
double ReducedMassKg(const ElasticBody& struck, const ElasticBody& striker,
                     const HertzContact& stated);

/// Returns the time for which the bodies touch, seconds (Johnson, Contact Mechanics, 11.4):
///
///   T = 2.87 (m^2 / (R E^2 v))^(1/5),  1/E = (1 - nu1^2)/E1 + (1 - nu2^2)/E2
///
/// The values of `stated` replace those that follow from the bodies. If the approach speed is
/// absent, it is v = J/(2 m), the speed at which two elastic bodies exchange the impulse J =
/// `impulse_newton_seconds`. The result is at most kLongestContactS.
double HertzDurationS(const ElasticBody& struck, const ElasticBody& striker,
                      const HertzContact& stated, double impulse_newton_seconds);

}  // namespace carillon
