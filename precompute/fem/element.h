// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/fem/elastic_constants.h"

namespace carillon::precompute {

/// How an element's mass is shared among its nodes.
enum class MassSharing { kConsistent, kLumped };

/// The geometry that determines the matrices of a straight-sided tetrahedron.
struct TetGeometry {
  /// Row i is the gradient of corner i's barycentric coordinate, 1/m: the first three columns of
  /// the paper's beta (O'Brien et al. 2002, 3.3).
  Eigen::Matrix<double, 4, 3> gradients;
  double volume_m3;
};

/// Returns the geometry for these corners (columns, metres). The volume is signed.
TetGeometry MakeTetGeometry(const Eigen::Matrix<double, 3, 4>& corners);

using LinearStiffness = Eigen::Matrix<double, 12, 12>;
using LinearMass = Eigen::Matrix<double, 4, 4>;
using QuadraticStiffness = Eigen::Matrix<double, 30, 30>;
using QuadraticMass = Eigen::Matrix<double, 10, 10>;

/// Returns the stiffness block of nodes i and j, where `c` is the integral of the outer product of
/// their gradients (c_ab = g_ia g_jb).
Eigen::Matrix3d StiffnessBlock(const Eigen::Matrix3d& c, const LameConstants& lame);

/// Returns the ten shape functions of the quadratic tetrahedron at a point: L(2L - 1) for corners,
/// 4 L_i L_j for mid-side nodes.
Eigen::Matrix<double, 10, 1> QuadraticValues(const Eigen::Vector4d& barycentric);

/// Returns the gradients (rows) of those ten shape functions. The rows of `g` are the gradients of
/// the barycentric coordinates.
Eigen::Matrix<double, 10, 3> QuadraticGradients(const Eigen::Matrix<double, 4, 3>& g,
                                                const Eigen::Vector4d& barycentric);

/// Returns the stiffness of the four-node tetrahedron, N/m. Unknown 3 i + a is component a of node
/// i.
///
///     k[ij]ab = vol (lambda beta_ia beta_jb + mu beta_ib beta_ja + mu delta_ab beta_i . beta_j)
///
/// The paper's eq. 12 has vol/2 instead of vol, which is an error: differentiating its eq. 10 gives
/// vol.
LinearStiffness MakeLinearStiffness(const TetGeometry& geometry, const LameConstants& lame);

/// Returns the mass of the four-node tetrahedron, kg, which is the same for each component. It is
/// rho vol/20 (1 + delta_ij), or rho vol/4 delta_ij if lumped (the paper's eq. 14 and 15).
LinearMass MakeLinearMass(double volume_m3, double density_kg_per_m3, MassSharing sharing);

/// Returns the stiffness, N/m, of the ten-node tetrahedron with straight edges and mid-side nodes
/// in the middle of the edges. Nodes are in the order of TetMesh. The four-point rule is exact,
/// because the integrand is quadratic.
QuadraticStiffness MakeQuadraticStiffness(const TetGeometry& geometry, const LameConstants& lame);

/// Returns the mass of the ten-node tetrahedron, kg, which is the same for each component. It is
/// lumped by diagonal scaling (Hinton, Rock, Zienkiewicz 1976), because row sums would give the
/// corners negative mass. A corner gets 1/36 of the mass, and a mid-side node gets 4/27.
QuadraticMass MakeQuadraticMass(double volume_m3, double density_kg_per_m3, MassSharing sharing);

}  // namespace carillon::precompute
