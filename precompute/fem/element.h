// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/fem/material.h"

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

/// Geometry from the corners (columns, metres); its volume is signed.
TetGeometry MakeTetGeometry(const Eigen::Matrix<double, 3, 4>& corners);

using LinearStiffness = Eigen::Matrix<double, 12, 12>;
using LinearMass = Eigen::Matrix<double, 4, 4>;
using QuadraticStiffness = Eigen::Matrix<double, 30, 30>;
using QuadraticMass = Eigen::Matrix<double, 10, 10>;

/// The block of two nodes whose gradients' outer product, integrated, is `c` (c_ab = g_ia g_jb).
Eigen::Matrix3d StiffnessBlock(const Eigen::Matrix3d& c, const LameConstants& lame);

/// The ten shape functions of the quadratic tetrahedron at a point: corners L(2L - 1), mid-sides
/// 4 L_i L_j.
Eigen::Matrix<double, 10, 1> QuadraticValues(const Eigen::Vector4d& barycentric);

/// Their gradients (rows), from those of the barycentric coordinates (rows of `g`).
Eigen::Matrix<double, 10, 3> QuadraticGradients(const Eigen::Matrix<double, 4, 3>& g,
                                                const Eigen::Vector4d& barycentric);

/// Stiffness of the four-node tetrahedron, N/m; unknown 3 i + a is component a of node i.
///
///     k[ij]ab = vol (lambda beta_ia beta_jb + mu beta_ib beta_ja + mu delta_ab beta_i . beta_j)
///
/// Deviates from the paper, whose eq. 12 prints vol/2: differentiating its eq. 10 gives vol.
LinearStiffness MakeLinearStiffness(const TetGeometry& geometry, const LameConstants& lame);

/// Mass of the four-node tetrahedron, kg, the same for each component: rho vol/20 (1 + delta_ij),
/// or lumped rho vol/4 delta_ij (the paper's eq. 14 and 15).
LinearMass MakeLinearMass(double volume_m3, double density_kg_per_m3, MassSharing sharing);

/// Stiffness of the ten-node tetrahedron with straight sides and mid-side nodes in their middles,
/// N/m; nodes in the order of TetMesh. Its integrand is quadratic, so that the four-point rule is
/// exact.
QuadraticStiffness MakeQuadraticStiffness(const TetGeometry& geometry, const LameConstants& lame);

/// Mass of the ten-node tetrahedron, kg, the same for each component; lumped by diagonal scaling
/// (Hinton, Rock, Zienkiewicz 1976: 1/36 a corner, 4/27 a mid-side node), because row sums would
/// give the corners negative mass.
QuadraticMass MakeQuadraticMass(double volume_m3, double density_kg_per_m3, MassSharing sharing);

}  // namespace carillon::precompute
