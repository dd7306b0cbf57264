// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/verification.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/modes/block_basis.h"
#include "precompute/modes/dense_blas.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Row = Eigen::Array<double, 1, kBlockWidth>;

/// Vectors of the user's unknowns, from column `first` on, as those of `A`; zero past the last.
VectorBlock Gather(const NodeMatrix& A, const std::vector<int32_t>& order, const MatrixXd& shapes,
                   Index first) {
  VectorBlock y = VectorBlock::Zero(shapes.rows(), kBlockWidth);
  for (Index c = first; c < std::min(first + kBlockWidth, shapes.cols()); ++c) {
    for (size_t i = 0; i < order.size(); ++i) {
      for (Index a = 0; a < 3; ++a) {
        y(3 * static_cast<Index>(i) + a, c - first) =
            A.root_mass[i] * shapes(3 * Index{order[i]} + a, c);
      }
    }
  }
  return y;
}

/// |D^1/2 (elastic - inertial Lambda)| / |D^1/2 inertial Lambda| of each column: D^1/2 takes the
/// products back to the user's unknowns.
Row RelativeResiduals(const NodeMatrix& A, const VectorBlock& elastic, const VectorBlock& inertial,
                      const Row& eigenvalues) {
  Row residual = Row::Zero();
  Row scale = Row::Zero();
  for (Index i = 0; i < elastic.rows(); ++i) {
    const double root = A.root_mass[static_cast<size_t>(i / 3)];
    const Row load = root * eigenvalues * inertial.row(i).array();
    residual += (root * elastic.row(i).array() - load).square();
    scale += load.square();
  }
  return (residual / scale).sqrt();
}

/// x^T y of n by k matrices, the lower triangle mirrored.
MatrixXd Gram(const MatrixXd& x, const MatrixXd& y, Workers& workers) {
  constexpr Index kStrip = 64;
  MatrixXd gram = MatrixXd::Zero(x.cols(), x.cols());
  workers.ForEach((x.cols() + kStrip - 1) / kStrip, [&](int64_t strip) {
    const Index j = strip * kStrip;
    blas::TransposedProduct(
        static_cast<int>(x.cols() - j), static_cast<int>(std::min(kStrip, x.cols() - j)),
        static_cast<int>(x.rows()), x.col(j).data(), static_cast<int>(x.rows()), y.col(j).data(),
        static_cast<int>(x.rows()), &gram(j, j), static_cast<int>(x.cols()));
  });
  return gram.selfadjointView<Eigen::Lower>();
}

std::vector<int32_t> NaturalOrder(const SystemMatrices& system) {
  std::vector<int32_t> order(static_cast<size_t>(system.unknown_count() / 3));
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int32_t>(i);
  return order;
}

Measurement MeasureAsAssembled(const SystemMatrices& system, const Modes& modes) {
  const std::vector<int32_t> order = NaturalOrder(system);
  Workers alone(1);
  return Measure(MakeNodeMatrix(system.K, system.M, order), order, modes, alone);
}

}  // namespace

Measurement Measure(const NodeMatrix& A, const std::vector<int32_t>& order, const Modes& modes,
                    Workers& workers) {
  const Index rows = modes.shapes.rows();
  const Index count = modes.shapes.cols();
  const MassRows<double> mass = MakeMassRows<double>(A);
  MatrixXd y(rows, count);
  MatrixXd inertial(A.mass_is_identity ? 0 : rows, count);
  Measurement result;
  result.residuals.resize(count);
  workers.ForEach((count + kBlockWidth - 1) / kBlockWidth, [&](int64_t b) {
    const Index first = b * kBlockWidth;
    const Index width = std::min<Index>(kBlockWidth, count - first);
    Workers alone(1);
    const VectorBlock block = Gather(A, order, modes.shapes, first);
    VectorBlock load = block;
    if (!A.mass_is_identity) MultiplyMass(mass, alone, block.data(), load.data());
    VectorBlock elastic(rows, kBlockWidth);
    MultiplyStiffness(A, block.data(), elastic.data());
    Row eigenvalues = Row::Ones();
    eigenvalues.head(width) = modes.eigenvalues.segment(first, width).transpose();
    result.residuals.segment(first, width) =
        RelativeResiduals(A, elastic, load, eigenvalues).head(width).matrix();
    y.middleCols(first, width) = block.leftCols(width);
    if (!A.mass_is_identity) inertial.middleCols(first, width) = load.leftCols(width);
  });
  result.gram = Gram(y, A.mass_is_identity ? y : inertial, workers);
  return result;
}

double ResidualOfRounding(double stiffest, double eigenvalue) {
  // Slender rods, held and free: measured 2 to 5 times the spacing of doubles.
  constexpr double kDigits = 16 * std::numeric_limits<double>::epsilon();
  constexpr double kMost = 1e-3;
  return std::min(kMost, kDigits * stiffest / std::abs(eigenvalue));
}

double StiffestNode(const NodeMatrix& A) {
  double stiffest = 0;
  for (size_t j = 0; j < static_cast<size_t>(A.node_count); ++j) {
    const double* block = &A.stiffness[9 * static_cast<size_t>(A.column_start[j])];
    stiffest = std::max({stiffest, block[0], block[4], block[8]});
  }
  return stiffest;
}

double OrthogonalityError(const MatrixXd& gram) {
  if (gram.size() == 0) return 0;
  return (gram - MatrixXd::Identity(gram.rows(), gram.cols())).cwiseAbs().maxCoeff();
}

Eigen::VectorXd Residuals(const SystemMatrices& system, const Modes& modes) {
  return MeasureAsAssembled(system, modes).residuals;
}

double OrthogonalityError(const SystemMatrices& system, const MatrixXd& shapes) {
  const Eigen::VectorXd none = Eigen::VectorXd::Ones(shapes.cols());
  return OrthogonalityError(
      MeasureAsAssembled(system, {.eigenvalues = none, .shapes = shapes}).gram);
}

}  // namespace carillon::precompute
