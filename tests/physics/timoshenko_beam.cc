// SPDX-License-Identifier: Apache-2.0
#include "tests/physics/timoshenko_beam.h"

#include <cmath>
#include <numbers>

namespace carillon {
namespace {

double FrequencyEquation(const FreeBeam& beam, const BeamMaterial& m, double omega) {
  const double shear = beam.shear_coefficient * m.young_pa / (2 * (1 + m.poisson_ratio));
  const double inertia = m.density_kg_per_m3 * omega * omega;
  const double p = inertia / m.young_pa * (1 + m.young_pa / shear);
  const double r = inertia * beam.area_m2 / (m.young_pa * beam.second_moment_m4) -
                   inertia * inertia / (m.young_pa * shear);
  const double root = std::sqrt(p * p + 4 * r);
  const double alpha = std::sqrt((root - p) / 2);
  const double beta = std::sqrt((root + p) / 2);
  const double q = inertia / shear;
  const double half = beam.length_m / 2;
  return (alpha * alpha + q) * std::tan(beta * half) / beta +
         (beta * beta - q) * std::tanh(alpha * half) / alpha;
}

}  // namespace

double FirstBendingHz(const FreeBeam& beam, const BeamMaterial& material) {
  // Euler's value, (4.73004 / L)^2 sqrt(EI / (rho A)), is an upper bound; the pole of tan at
  // beta L = pi lies far below.
  const double euler = std::pow(4.730040744862704 / beam.length_m, 2) *
                       std::sqrt(material.young_pa * beam.second_moment_m4 /
                                 (material.density_kg_per_m3 * beam.area_m2));
  double low = 0.6 * euler;
  double high = euler;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (FrequencyEquation(beam, material, middle) < 0 ? low : high) = middle;
  }
  return low / (2 * std::numbers::pi);
}

double ClampedBendingHz(const FreeBeam& beam, int order, const BeamMaterial& material) {
  const double bending = material.young_pa * beam.second_moment_m4;
  const double shear = beam.shear_coefficient * beam.area_m2 * material.young_pa /
                       (2 * (1 + material.poisson_ratio));
  const double r2 = beam.second_moment_m4 / (beam.area_m2 * beam.length_m * beam.length_m);
  const double s2 = bending / (shear * beam.length_m * beam.length_m);
  // Below the frequency at which shear alone resonates, so that all is real.
  const auto equation = [&](double b) {
    const double root = std::sqrt((r2 - s2) * (r2 - s2) + 4 / (b * b));
    const double alpha = std::sqrt((root - r2 - s2) / 2);
    const double beta = std::sqrt((root + r2 + s2) / 2);
    return 2 + (b * b * (r2 - s2) * (r2 - s2) + 2) * std::cosh(b * alpha) * std::cos(b * beta) -
           b * (r2 + s2) / std::sqrt(1 - b * b * r2 * s2) * std::sinh(b * alpha) *
               std::sin(b * beta);
  };
  constexpr double kStep = 0.01;  // far below the distance of two roots
  double b = kStep;
  for (int found = 0; found < order; b += kStep) {
    if (equation(b) * equation(b + kStep) <= 0) ++found;
  }
  double low = b - kStep;
  double high = b;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (equation(low) * equation(middle) <= 0 ? high : low) = middle;
  }
  return low / (2 * std::numbers::pi) *
         std::sqrt(bending / (material.density_kg_per_m3 * beam.area_m2)) /
         (beam.length_m * beam.length_m);
}

FreeBeam RectangularBeam(double length_m, double height_m, double width_m, double poisson_ratio) {
  return {.length_m = length_m,
          .area_m2 = height_m * width_m,
          .second_moment_m4 = width_m * std::pow(height_m, 3) / 12,
          .shear_coefficient = 10 * (1 + poisson_ratio) / (12 + 11 * poisson_ratio)};
}

}  // namespace carillon
