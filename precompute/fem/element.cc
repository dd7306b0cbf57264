// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/element.h"

#include <Eigen/LU>
#include <array>
#include <utility>

namespace carillon::precompute {
namespace {

/// Corners at the ends of each mid-side node's edge, in the order of TetMesh.
constexpr std::array<std::pair<int, int>, 6> kEdges = {
    {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

/// The four points of the rule that is exact for quadratics have one barycentric coordinate kNear
/// and three kFar; each weighs a quarter of the volume.
constexpr double kNear = 0.58541019662496845446;
constexpr double kFar = 0.13819660112501051518;

/// The integral of N_i N_j over a tetrahedron of volume 420.
int QuadraticMassNumerator(int i, int j) {
  if (i < 4 && j < 4) return i == j ? 6 : 1;
  if (i >= 4 && j >= 4) {
    if (i == j) return 32;
    const auto [a, b] = kEdges[static_cast<size_t>(i - 4)];
    const auto [c, d] = kEdges[static_cast<size_t>(j - 4)];
    return a == c || a == d || b == c || b == d ? 16 : 8;
  }
  const int corner = std::min(i, j);
  const auto [a, b] = kEdges[static_cast<size_t>(std::max(i, j) - 4)];
  return corner == a || corner == b ? -4 : -6;
}

QuadraticMass MakeUnitQuadraticMass() {
  QuadraticMass mass;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) mass(i, j) = QuadraticMassNumerator(i, j) / 420.0;
  }
  return mass;
}

}  // namespace

Eigen::Matrix3d StiffnessBlock(const Eigen::Matrix3d& c, const LameConstants& lame) {
  Eigen::Matrix3d block = lame.lambda_pa * c + lame.mu_pa * c.transpose();
  block.diagonal().array() += lame.mu_pa * c.trace();
  return block;
}

Eigen::Matrix<double, 10, 1> QuadraticValues(const Eigen::Vector4d& barycentric) {
  Eigen::Matrix<double, 10, 1> values;
  values.head<4>() = barycentric.array() * (2 * barycentric.array() - 1);
  for (int e = 0; e < 6; ++e) {
    const auto [i, j] = kEdges[static_cast<size_t>(e)];
    values[4 + e] = 4 * barycentric[i] * barycentric[j];
  }
  return values;
}

Eigen::Matrix<double, 10, 3> QuadraticGradients(const Eigen::Matrix<double, 4, 3>& g,
                                                const Eigen::Vector4d& barycentric) {
  Eigen::Matrix<double, 10, 3> gradients;
  for (int i = 0; i < 4; ++i) gradients.row(i) = (4 * barycentric[i] - 1) * g.row(i);
  for (int e = 0; e < 6; ++e) {
    const auto [i, j] = kEdges[static_cast<size_t>(e)];
    gradients.row(4 + e) = 4 * (barycentric[i] * g.row(j) + barycentric[j] * g.row(i));
  }
  return gradients;
}

TetGeometry MakeTetGeometry(const Eigen::Matrix<double, 3, 4>& corners) {
  Eigen::Matrix3d edges;
  for (int i = 0; i < 3; ++i) edges.col(i) = corners.col(i + 1) - corners.col(0);
  TetGeometry geometry;
  geometry.volume_m3 = edges.determinant() / 6;
  geometry.gradients.bottomRows<3>() = edges.inverse();
  geometry.gradients.row(0) = -geometry.gradients.bottomRows<3>().colwise().sum();
  return geometry;
}

LinearStiffness MakeLinearStiffness(const TetGeometry& geometry, const LameConstants& lame) {
  LinearStiffness stiffness;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const Eigen::Matrix3d outer =
          geometry.gradients.row(i).transpose() * geometry.gradients.row(j);
      stiffness.block<3, 3>(3 * i, 3 * j) = geometry.volume_m3 * StiffnessBlock(outer, lame);
    }
  }
  return stiffness;
}

LinearMass MakeLinearMass(double volume_m3, double density_kg_per_m3, MassSharing sharing) {
  const double mass = volume_m3 * density_kg_per_m3;
  if (sharing == MassSharing::kLumped) return mass / 4 * LinearMass::Identity();
  return mass / 20 * (LinearMass::Ones() + LinearMass::Identity());
}

QuadraticStiffness MakeQuadraticStiffness(const TetGeometry& geometry, const LameConstants& lame) {
  // Column q is the gradient table at point q: the integrated outer product of nodes i and j is
  // then a product of two 3x4 matrices.
  std::array<Eigen::Matrix<double, 3, 4>, 10> gradients;
  for (int q = 0; q < 4; ++q) {
    Eigen::Vector4d point = Eigen::Vector4d::Constant(kFar);
    point[q] = kNear;
    const Eigen::Matrix<double, 10, 3> at_point = QuadraticGradients(geometry.gradients, point);
    for (int i = 0; i < 10; ++i) gradients[static_cast<size_t>(i)].col(q) = at_point.row(i);
  }
  QuadraticStiffness stiffness;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j <= i; ++j) {
      const Eigen::Matrix3d outer = geometry.volume_m3 / 4 * gradients[static_cast<size_t>(i)] *
                                    gradients[static_cast<size_t>(j)].transpose();
      const Eigen::Matrix3d block = StiffnessBlock(outer, lame);
      stiffness.block<3, 3>(3 * i, 3 * j) = block;
      stiffness.block<3, 3>(3 * j, 3 * i) = block.transpose();
    }
  }
  return stiffness;
}

QuadraticMass MakeQuadraticMass(double volume_m3, double density_kg_per_m3, MassSharing sharing) {
  static const QuadraticMass unit = MakeUnitQuadraticMass();
  const double mass = volume_m3 * density_kg_per_m3;
  if (sharing == MassSharing::kConsistent) return mass * unit;
  const QuadraticMass diagonal = unit.diagonal().asDiagonal();
  return mass / diagonal.trace() * diagonal;
}

}  // namespace carillon::precompute
