// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Index of the harmonic of order l and degree m, -l <= m <= l.
inline size_t HarmonicIndex(int l, int m) { return static_cast<size_t>(l * l + l + m); }
inline size_t HarmonicCount(int order) {
  return static_cast<size_t>(order + 1) * static_cast<size_t>(order + 1);
}

/// The real, orthonormal harmonics up to `order` in a direction (of any length but zero):
///
///     Y_lm = n_l|m| P_l^|m|(cos theta) * { sqrt(2) cos(m phi), m > 0;  1, m = 0;
///                                          sqrt(2) sin(|m| phi), m < 0 }
///
/// without the phase of Condon and Shortley; theta from the z axis, phi from x to y.
std::vector<double> RealHarmonics(int order, const Point& direction);

/// Directions and weights that integrate products of two harmonics up to `order` exactly: Gauss's
/// nodes in cos theta, equal steps in phi.
class SphereGrid {
 public:
  explicit SphereGrid(int order);

  int order() const { return order_; }
  const std::vector<Point>& directions() const { return directions_; }
  /// Solid angles; they sum to 4 pi.
  const std::vector<double>& weights() const { return weights_; }

  /// Integrals of Y_lm times the function with these values at the directions.
  std::vector<std::complex<double>> Analyse(std::span<const std::complex<double>> values) const;

  /// The inverse: values at the directions of the function with these coefficients.
  std::vector<std::complex<double>> Synthesise(
      std::span<const std::complex<double>> coefficients) const;

 private:
  int order_;
  std::vector<Point> directions_;  ///< phi fastest
  std::vector<double> weights_;
};

}  // namespace carillon::precompute
