// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/rigid_body.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>

namespace carillon::precompute {

Eigen::MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system) {
  Eigen::Map<const Eigen::Matrix3Xd> positions(nodes.front().data(), 3,
                                               static_cast<Eigen::Index>(nodes.size()));
  const Eigen::Vector3d centroid = positions.rowwise().mean();
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * positions.cols(), 6);
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    const Eigen::Vector3d arm = positions.col(i) - centroid;
    motions.block<3, 3>(3 * i, 0).setIdentity();
    for (int axis = 0; axis < 3; ++axis) {
      motions.block<3, 1>(3 * i, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
    }
  }
  const Eigen::MatrixXd gram =
      motions.transpose() * (system.M.selfadjointView<Eigen::Lower>() * motions);
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  factor.matrixU().solveInPlace<Eigen::OnTheRight>(motions);
  return motions;
}

double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system) {
  Eigen::Map<const Eigen::Matrix3Xd> positions(nodes.front().data(), 3,
                                               static_cast<Eigen::Index>(nodes.size()));
  const Eigen::Vector3d centroid = positions.rowwise().mean();
  const double size = (positions.colwise() - centroid).cwiseAbs().maxCoeff();
  Eigen::MatrixXd fields = Eigen::MatrixXd::Zero(3 * positions.cols(), 30);
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    const Eigen::Vector3d p = (positions.col(i) - centroid) / size;
    const std::array<double, 10> terms = {1,           p[0],        p[1],        p[2],
                                          p[0] * p[0], p[1] * p[1], p[2] * p[2], p[0] * p[1],
                                          p[1] * p[2], p[2] * p[0]};
    for (Eigen::Index t = 0; t < 10; ++t) {
      for (int axis = 0; axis < 3; ++axis) {
        fields(3 * i + axis, 3 * t + axis) = terms[static_cast<size_t>(t)];
      }
    }
  }
  const Eigen::MatrixXd K =
      fields.transpose() * (system.K.selfadjointView<Eigen::Lower>() * fields);
  const Eigen::MatrixXd M =
      fields.transpose() * (system.M.selfadjointView<Eigen::Lower>() * fields);
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(K, M, Eigen::EigenvaluesOnly)
      .eigenvalues()[6];
}

}  // namespace carillon::precompute
