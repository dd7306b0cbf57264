// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/rigid_body.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Motions of the fixed nodes that are smaller than this fraction of the largest motion count as
/// rounding errors.
constexpr double kRankTolerance = 1e-6;

/// Largest number of fixed nodes used to compute the distance of other nodes.
constexpr size_t kMaxDistanceSamples = 256;

Eigen::Map<const Eigen::Matrix3Xd> Positions(const std::vector<Point>& nodes) {
  return {nodes.front().data(), 3, static_cast<Index>(nodes.size())};
}

/// The centre of the nodes, and half of their extent.
struct Frame {
  explicit Frame(const std::vector<Point>& nodes)
      : centroid(Positions(nodes).rowwise().mean()),
        size((Positions(nodes).colwise() - centroid).cwiseAbs().maxCoeff()) {}

  Eigen::Vector3d centroid;
  double size;
};

/// Returns the translations and then the rotations about the centroid, 3 #nodes by 6. A rotation
/// moves a node at the distance `size` from the axis by one.
MatrixXd Motions(const std::vector<Point>& nodes, const Frame& frame) {
  MatrixXd motions = MatrixXd::Zero(3 * static_cast<Index>(nodes.size()), 6);
  for (size_t n = 0; n < nodes.size(); ++n) {
    const auto i = static_cast<Index>(n);
    const Eigen::Vector3d arm =
        (Eigen::Vector3d::Map(nodes[n].data()) - frame.centroid) / frame.size;
    motions.block<3, 3>(3 * i, 0).setIdentity();
    for (int axis = 0; axis < 3; ++axis) {
      motions.block<3, 1>(3 * i, 3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
    }
  }
  return motions;
}

/// Returns the combinations of the six motions that do not move the fixed nodes, 6 by the number of
/// combinations.
MatrixXd FreeCombinations(const std::vector<Point>& fixed, const Frame& frame) {
  if (fixed.empty()) return MatrixXd::Identity(6, 6);
  const MatrixXd motions = Motions(fixed, frame);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> gram(motions.transpose() * motions);
  const double largest = gram.eigenvalues().maxCoeff();
  const Index count =
      (gram.eigenvalues().array() < kRankTolerance * kRankTolerance * largest).count();
  return gram.eigenvectors().leftCols(count);
}

/// Returns the distance of each node to the nearest fixed node, relative to the body's size, or one
/// if no node is fixed.
Eigen::VectorXd Weights(const std::vector<Point>& nodes, const std::vector<Point>& fixed,
                        double size) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(static_cast<Index>(nodes.size()));
  if (fixed.empty()) return weights;
  const size_t stride = (fixed.size() + kMaxDistanceSamples - 1) / kMaxDistanceSamples;
  for (size_t n = 0; n < nodes.size(); ++n) {
    const auto p = Eigen::Vector3d::Map(nodes[n].data());
    double nearest = HUGE_VAL;
    for (size_t h = 0; h < fixed.size(); h += stride) {
      nearest = std::min(nearest, (p - Eigen::Vector3d::Map(fixed[h].data())).squaredNorm());
    }
    weights[static_cast<Index>(n)] = std::sqrt(nearest) / size;
  }
  return weights;
}

/// Returns displacements that are polynomials of second degree times the distance to the fixed
/// nodes.
MatrixXd PolynomialFields(const std::vector<Point>& nodes, const std::vector<Point>& fixed) {
  const Frame frame(nodes);
  const Eigen::VectorXd weights = Weights(nodes, fixed, frame.size);
  MatrixXd fields = MatrixXd::Zero(3 * static_cast<Index>(nodes.size()), 30);
  for (size_t n = 0; n < nodes.size(); ++n) {
    const auto i = static_cast<Index>(n);
    const Eigen::Vector3d p = (Eigen::Vector3d::Map(nodes[n].data()) - frame.centroid) / frame.size;
    const std::array<double, 10> terms = {1,           p[0],        p[1],        p[2],
                                          p[0] * p[0], p[1] * p[1], p[2] * p[2], p[0] * p[1],
                                          p[1] * p[2], p[2] * p[0]};
    for (Index t = 0; t < 10; ++t) {
      for (int axis = 0; axis < 3; ++axis) {
        fields(3 * i + axis, 3 * t + axis) = weights[i] * terms[static_cast<size_t>(t)];
      }
    }
  }
  return fields;
}

}  // namespace

MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system,
                        const std::vector<Point>& fixed) {
  const Frame frame(nodes);
  MatrixXd motions = Motions(nodes, frame) * FreeCombinations(fixed, frame);
  if (motions.cols() == 0) return motions;
  const MatrixXd gram = motions.transpose() * (system.M.selfadjointView<Eigen::Lower>() * motions);
  const Eigen::LLT<MatrixXd> factor(gram);
  factor.matrixU().solveInPlace<Eigen::OnTheRight>(motions);
  return motions;
}

double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system,
                             const std::vector<Point>& fixed) {
  MatrixXd fields = PolynomialFields(nodes, fixed);
  Index rigid_count = 6;  // a free body's rigid-body modes are first-degree polynomials
  if (!fixed.empty()) {
    const MatrixXd rigid = RigidBodyModes(nodes, system, fixed);
    rigid_count = rigid.cols();
    fields.conservativeResize(Eigen::NoChange, 30 + rigid_count);
    fields.rightCols(rigid_count) = rigid;
  }
  // If there are very few nodes, the displacements are linearly dependent.
  if (system.unknown_count() < 2 * fields.cols()) {
    return (system.K.diagonal().array() / system.M.diagonal().array()).maxCoeff();
  }
  const MatrixXd K = fields.transpose() * (system.K.selfadjointView<Eigen::Lower>() * fields);
  const MatrixXd M = fields.transpose() * (system.M.selfadjointView<Eigen::Lower>() * fields);
  return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M, Eigen::EigenvaluesOnly)
      .eigenvalues()[rigid_count];
}

}  // namespace carillon::precompute
