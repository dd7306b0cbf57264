// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace carillon::precompute {

/// A point of a quadrature rule over the tetrahedron. The weights of a rule add up to one; all
/// points lie inside, and all weights are positive.
struct TetRulePoint {
  Eigen::Vector4d barycentric;
  double weight;
};

/// Fourteen points, exact for polynomials of degree five (Walkington, Quadrature on simplices of
/// arbitrary dimension, 2000).
const std::vector<TetRulePoint>& TetRuleOfDegree5();

/// Sixty-four points, exact for polynomials of degree seven: the product of Gauss-Jacobi rules of
/// four points, collapsed onto the tetrahedron.
const std::vector<TetRulePoint>& TetRuleOfDegree7();

}  // namespace carillon::precompute
