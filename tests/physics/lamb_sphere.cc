// SPDX-License-Identifier: Apache-2.0
#include "tests/physics/lamb_sphere.h"

#include <cmath>

namespace carillon {
namespace {

double J(unsigned l, double x) { return std::sph_bessel(l, x); }

double TorsionalEquation(double eta) { return J(2, eta) - eta * J(3, eta); }

/// Stress-free surface: the determinant of radial and tangential stress (rows) of the potentials of
/// compression and of shear (columns), at degree l = 2.
double SpheroidalEquation(double eta, double poisson_ratio) {
  const double xi = eta * std::sqrt((1 - 2 * poisson_ratio) / (2 * (1 - poisson_ratio)));
  const double radial_compression = (2 - eta * eta / 2) * J(2, xi) + 2 * xi * J(3, xi);
  const double radial_shear = 6 * (J(2, eta) - eta * J(3, eta));
  const double tangential_compression = J(2, xi) - xi * J(3, xi);
  const double tangential_shear = (3 - eta * eta / 2) * J(2, eta) + eta * J(3, eta);
  return radial_compression * tangential_shear - radial_shear * tangential_compression;
}

/// The lowest root above `from`.
template <typename F>
double LowestRoot(F f, double from) {
  constexpr double kStep = 0.01;
  double low = from;
  while ((f(low) < 0) == (f(low + kStep) < 0)) low += kStep;
  double high = low + kStep;
  const bool sign = f(low) < 0;
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    ((f(middle) < 0) == sign ? low : high) = middle;
  }
  return low;
}

}  // namespace

double LowestTorsionalEta() { return LowestRoot(TorsionalEquation, 0.5); }

double LowestSpheroidalEta(double poisson_ratio) {
  return LowestRoot([=](double eta) { return SpheroidalEquation(eta, poisson_ratio); }, 0.5);
}

}  // namespace carillon
