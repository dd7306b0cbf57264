// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/hertz.h"

#include <algorithm>
#include <cmath>

#include "server/excitation/contact.h"

namespace carillon {
namespace {

/// Returns (1 - nu^2)/E, 1/Pa.
double Compliance(double young_pa, double poisson_ratio) {
  return (1 - poisson_ratio * poisson_ratio) / young_pa;
}

}  // namespace

double ReducedMassKg(const ElasticBody& struck, const ElasticBody& striker,
                     const HertzContact& stated) {
  const double striker_mass = stated.striker_mass_kg.value_or(striker.mass_kg);
  return stated.reduced_mass_kg.value_or(1 / (1 / struck.mass_kg + 1 / striker_mass));
}

double HertzDurationS(const ElasticBody& struck, const ElasticBody& striker,
                      const HertzContact& stated, double impulse_newton_seconds) {
  const double mass = ReducedMassKg(struck, striker, stated);
  const double striker_curvature =
      stated.striker_radius_m ? 1 / *stated.striker_radius_m : striker.curvature_per_m;
  const double curvature =
      stated.reduced_radius_m
          ? 1 / *stated.reduced_radius_m
          : std::max(struck.curvature_per_m + striker_curvature, 1 / kFlattestRadiusM);
  const double modulus =
      1 / (Compliance(struck.young_pa, struck.poisson_ratio) +
           Compliance(stated.striker_young_pa.value_or(striker.young_pa),
                      stated.striker_poisson_ratio.value_or(striker.poisson_ratio)));
  const double speed = stated.approach_speed_m_per_s.value_or(impulse_newton_seconds / (2 * mass));
  const double duration_s =
      2.87 * std::pow(mass * mass * curvature / (modulus * modulus * speed), 0.2);
  return std::min(duration_s, kLongestContactS);
}

}  // namespace carillon
