// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace carillon::precompute {

/// A point of a quadrature rule over the tetrahedron. The weights of a rule are positive and add up
/// to one, and all points lie inside.
struct TetRulePoint {
  Eigen::Vector4d barycentric;
  double weight;
};

/// Returns a rule of fourteen points that is exact for polynomials of degree five (Walkington,
/// Quadrature on simplices of arbitrary dimension, 2000).
const std::vector<TetRulePoint>& TetRuleOfDegree5();

/// Returns a rule of sixty-four points that is exact for polynomials of degree seven. It is the
/// product of Gauss-Jacobi rules of four points, collapsed onto the tetrahedron.
const std::vector<TetRulePoint>& TetRuleOfDegree7();

}  // namespace carillon::precompute
