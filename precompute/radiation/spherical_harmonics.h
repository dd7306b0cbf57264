// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns the index of the harmonic of order l and degree m, -l <= m <= l.
inline size_t HarmonicIndex(int l, int m) { return static_cast<size_t>(l * l + l + m); }
inline size_t HarmonicCount(int order) {
  return static_cast<size_t>(order + 1) * static_cast<size_t>(order + 1);
}

/// Directions and weights that integrate products of two harmonics up to `order` exactly. The
/// directions are Gauss's nodes in cos theta and equal steps in phi. The harmonics are real and
/// orthonormal:
///
///     Y_lm = n_l|m| P_l^|m|(cos theta) * { sqrt(2) cos(m phi), m > 0;  1, m = 0;
///                                          sqrt(2) sin(|m| phi), m < 0 }
///
/// without the phase of Condon and Shortley. theta is measured from the z axis, and phi from x to
/// y.
class SphereGrid {
 public:
  explicit SphereGrid(int order);

  int order() const { return order_; }
  const std::vector<Point>& directions() const { return directions_; }
  /// Returns the solid angles of the directions, which sum to 4 pi.
  const std::vector<double>& weights() const { return weights_; }

  /// Returns the integrals of Y_lm times the function that has these values at the directions.
  std::vector<std::complex<double>> Analyse(std::span<const std::complex<double>> values) const;

  /// Returns the values at the directions of the function that has these coefficients. This is the
  /// inverse of Analyse.
  std::vector<std::complex<double>> Synthesise(
      std::span<const std::complex<double>> coefficients) const;

 private:
  int order_;
  std::vector<Point> directions_;  ///< phi varies fastest
  std::vector<double> weights_;
};

}  // namespace carillon::precompute
