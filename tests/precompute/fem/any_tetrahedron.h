// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "precompute/fem/curved_element.h"

namespace carillon::precompute {

constexpr LameConstants kLame{.lambda_pa = 2.1, .mu_pa = 1.3};
constexpr double kDensity = 3.7;

/// The corners of a tetrahedron without symmetry, and the middles of its edges.
inline TenNodes AnyNodes() {
  TenNodes nodes;
  nodes.leftCols<4>() << 0.1, 1.2, 0.3, 0.2,  //
      -0.2, 0.1, 0.9, 0.3,                    //
      0.0, 0.2, -0.1, 1.1;
  for (size_t e = 0; e < 6; ++e) {
    const auto& [i, j] = kTetEdges[e];
    nodes.col(static_cast<Eigen::Index>(4 + e)) = (nodes.col(i) + nodes.col(j)) / 2;
  }
  return nodes;
}

/// A displacement gradient, and its energy density in linear elasticity.
inline const Eigen::Matrix3d kGradient{{0.3, -0.7, 0.2}, {0.5, 0.1, 0.9}, {-0.4, 0.6, -0.8}};
inline double EnergyDensity() {
  const Eigen::Matrix3d strain = (kGradient + kGradient.transpose()) / 2;
  return kLame.lambda_pa / 2 * strain.trace() * strain.trace() + kLame.mu_pa * strain.squaredNorm();
}

/// Expects that exactly six motions have no energy, and that a displacement of constant gradient
/// has the energy that the theory of elasticity gives.
template <int N>
void ExpectStiffness(const Eigen::Matrix<double, 3 * N, 3 * N>& k, const TenNodes& nodes,
                     double volume_m3, double rounding) {
  const Eigen::Matrix<double, 3 * N, 1> eigenvalues =
      k.template selfadjointView<Eigen::Lower>().eigenvalues();
  EXPECT_NEAR(eigenvalues.template head<6>().cwiseAbs().maxCoeff(), 0, rounding);
  EXPECT_GT(eigenvalues[6], 1e-2);
  const Eigen::Matrix<double, 3, N> moved =
      (kGradient * nodes.leftCols<N>()).colwise() + Eigen::Vector3d(1, 2, 3);
  const Eigen::Matrix<double, 3 * N, 1> u = moved.reshaped();
  EXPECT_NEAR(u.dot(k * u) / 2, volume_m3 * EnergyDensity(), 1e-13);
}

}  // namespace carillon::precompute
