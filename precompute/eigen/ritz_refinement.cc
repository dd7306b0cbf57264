// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/ritz_refinement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/residual_kernels.h"
#include "precompute/eigen/verification.h"
#include "precompute/sparse/block_kernels.h"
#include "precompute/sparse/dense_blas.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Limit of |K phi - Lambda M phi| / |Lambda M phi| in the Euclidean norm, in the unknowns of the
/// user.
constexpr double kRefinedTolerance = 8e-7;

constexpr int kMaxRounds = 6;

/// After this many rounds the remaining error lies in modes just above the wanted ones. One
/// correction removes about a third of it, so that two corrections are cheaper than another
/// projection.
constexpr int kQuickRounds = 2;

/// Approximate fraction of the remaining work that one round does, and the fraction of a round that
/// the corrections take.
constexpr double kRoundPart = 0.8;
constexpr double kCorrectionPart = 0.7;

template <typename Real>
class Refinement {
 public:
  Refinement(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
             const MatrixXd& deflated, const RefinementPlan& plan, Workers& workers)
      : A_(A),
        factor_(factor),
        mass_(MakeMassRows<double>(A)),
        workers_(workers),
        wanted_(plan.wanted),
        free_motion_(plan.free_motion),
        stiffest_(StiffestNode(A)),
        rows_(3 * static_cast<Index>(A.node_count)),
        deflated_(VectorBlock::Zero(rows_, kBlockWidth)) {
    deflated_.leftCols(deflated.cols()) = deflated;
    deflated_momenta_ = deflated_;
    if (!A_.mass_is_identity) {
      MultiplyMass(mass_, workers_, deflated_.data(), deflated_momenta_.data());
    }
  }

  void Take(std::vector<VectorBlockOf<Real>> rough) {
    x_.resize(rough.size());
    elastic_.resize(rough.size());
    inertial_.resize(A_.mass_is_identity ? 0 : rough.size());
    quotients_.resize(rough.size());
    ForBlocks([&](size_t b) {
      x_[b] = rough[b].template cast<double>();
      rough[b].resize(0, kBlockWidth);
      elastic_[b].resize(rows_, kBlockWidth);
      if (!A_.mass_is_identity) inertial_[b].resize(rows_, kBlockWidth);
      Multiply(b);
    });
  }

  /// Corrects every block of vectors `steps` times, unless its wanted vectors are accurate already.
  /// Project removes the components of other modes that a correction adds.
  void Correct(int steps) {
    const std::vector<size_t> bad = BadBlocks();
    const size_t width = GroupWidth(bad.size());
    workers_.ForEach(static_cast<int64_t>((bad.size() + width - 1) / width), [&](int64_t group) {
      const size_t first = static_cast<size_t>(group) * width;
      const std::span blocks(&bad[first], std::min(width, bad.size() - first));
      Eigen::Matrix<Real, Eigen::Dynamic, 1> change(rows_ * kBlockWidth *
                                                    static_cast<Index>(blocks.size()));
      for (int step = 0; step < steps; ++step) CorrectBlocks(blocks, change.data());
    });
  }

  /// x := x V with V from the projected problem.
  bool Project() {
    MatrixXd stiffness = Gram(x_, elastic_, workers_);
    MatrixXd mass = Gram(x_, A_.mass_is_identity ? x_ : inertial_, workers_);
    const int size = static_cast<int>(stiffness.rows());
    eigenvalues_.resize(size);
    if (!blas::GeneralizedEigen(size, stiffness.data(), mass.data(), eigenvalues_.data())) {
      return false;
    }
    Rotate(stiffness, workers_, x_);
    return true;
  }

  /// The largest residual of the wanted modes.
  double LargestResidual() {
    residuals_.resize(static_cast<Index>(x_.size()) * kBlockWidth);
    ForBlocks([&](size_t b) {
      Multiply(b);
      const Row residual = RelativeResiduals(A_, elastic_[b], Inertial(b), quotients_[b]);
      residuals_.segment<kBlockWidth>(static_cast<Index>(b) * kBlockWidth) =
          (quotients_[b].abs() < free_motion_).select(0, residual).matrix().transpose();
    });
    return residuals_.head(wanted_).maxCoeff();
  }

  /// Whether the residuals of the wanted modes are as small as rounding allows.
  bool IsExhausted() const {
    for (Index m = 0; m < wanted_; ++m) {
      const double rounding = ResidualOfRounding(stiffest_, eigenvalues_[m]);
      if (!(residuals_[m] <= std::max(kRefinedTolerance, rounding))) return false;
    }
    return true;
  }

  RefinedModes Result() {
    return {.eigenvalues = eigenvalues_.head(wanted_), .shapes = std::move(x_)};
  }

 private:
  using Row = BlockRow;

  template <typename Visit>
  void ForBlocks(const Visit& visit) {
    workers_.ForEach(static_cast<int64_t>(x_.size()),
                     [&](int64_t b) { visit(static_cast<size_t>(b)); });
  }

  const VectorBlock& Inertial(size_t b) const { return A_.mass_is_identity ? x_[b] : inertial_[b]; }

  /// All blocks until residuals are known; afterwards the blocks with a wanted vector that is not
  /// accurate yet.
  std::vector<size_t> BadBlocks() const {
    std::vector<size_t> bad;
    for (size_t b = 0; b < x_.size(); ++b) {
      const Index first = static_cast<Index>(b) * kBlockWidth;
      const Index count = std::clamp<Index>(wanted_ - first, 0, kBlockWidth);
      const bool good =
          residuals_.size() != 0 &&
          (count == 0 || residuals_.segment(first, count).maxCoeff() <= kRefinedTolerance);
      if (!good) bad.push_back(b);
    }
    return bad;
  }

  /// Two blocks at once share one pass over a factor in float, as long as each thread has enough
  /// blocks.
  size_t GroupWidth(size_t blocks) const {
    const auto threads = static_cast<size_t>(workers_.count());
    return std::is_same_v<Real, float> && blocks >= 2 * threads ? 2 : 1;
  }

  /// The products of a block of vectors and their Rayleigh quotients.
  void Multiply(size_t b) {
    MultiplyStiffness(A_, x_[b].data(), elastic_[b].data());
    if (!A_.mass_is_identity) {
      Workers alone(1);
      MultiplyMass(mass_, alone, x_[b].data(), inertial_[b].data());
    }
    Row energy = Row::Zero();
    Row mass = Row::Zero();
    AddRayleighSums(x_[b].data(), elastic_[b].data(), Inertial(b).data(), rows_, energy.data(),
                    mass.data());
    quotients_[b] = energy / mass;
  }

  /// `change`: memory for the changes of all blocks, side by side in each row.
  void CorrectBlocks(std::span<const size_t> blocks, Real* change) {
    const auto stride = static_cast<int64_t>(blocks.size()) * kBlockWidth;
    for (size_t i = 0; i < blocks.size(); ++i) {
      const size_t b = blocks[i];
      StoreResidual(quotients_[b].data(), elastic_[b].data(), Inertial(b).data(), rows_, stride,
                    change + i * kBlockWidth);
    }
    Solve(change, blocks.size());
    for (size_t i = 0; i < blocks.size(); ++i) {
      Subtract(change + i * kBlockWidth, stride, blocks[i]);
      Multiply(blocks[i]);
    }
  }

  void Solve(Real* change, size_t blocks) const {
    if constexpr (std::is_same_v<Real, float>) {
      if (blocks == 2) {
        factor_.SolveWide(change);
        return;
      }
    }
    Workers alone(1);
    factor_.Solve(change, alone);
  }

  /// x -= change, kept orthogonal to the deflated vectors.
  void Subtract(const Real* change, int64_t stride, size_t b) {
    SmallBlock deflated = SmallBlock::Zero();
    SmallBlock h;
    constexpr Index kRows = 256;
    for (Index i = 0; i < rows_; i += kRows) {
      const Index count = std::min(kRows, rows_ - i);
      double* x = x_[b].data() + i * kBlockWidth;
      SubtractChange(change + i * stride, stride, count, x);
      BlockDot(deflated_momenta_.data() + i * kBlockWidth, x, count, h.data());
      deflated += h;
    }
    BlockSubtractTimes(deflated_.data(), deflated.data(), rows_, x_[b].data());
  }

  const NodeMatrix& A_;
  const MultifrontalCholesky<Real>& factor_;
  MassRows<double> mass_;
  Workers& workers_;
  Index wanted_;
  double free_motion_;
  double stiffest_;
  Index rows_;
  VectorBlock deflated_;
  VectorBlock deflated_momenta_;  ///< M times deflated_
  VectorBlocks x_;
  VectorBlocks elastic_;   ///< K x
  VectorBlocks inertial_;  ///< M x, unless the mass matrix is the identity
  std::vector<Row> quotients_;
  VectorXd residuals_;
  VectorXd eigenvalues_;
};

}  // namespace

template <typename Real>
absl::StatusOr<RefinedModes> RefineModes(const NodeMatrix& A,
                                         const MultifrontalCholesky<Real>& factor,
                                         const MatrixXd& deflated,
                                         std::vector<VectorBlockOf<Real>> rough,
                                         const RefinementPlan& plan, Workers& workers,
                                         const SolveProgress& progress) {
  Refinement<Real> refinement(A, factor, deflated, plan, workers);
  refinement.Take(std::move(rough));
  double residual = std::numeric_limits<double>::infinity();
  double left = 1;
  int steps = plan.first_steps;
  for (int round = 0; round < kMaxRounds; ++round, left *= 1 - kRoundPart) {
    progress(1 - left);
    refinement.Correct(steps);
    progress(1 - left * (1 - kRoundPart * kCorrectionPart));
    if (!refinement.Project()) break;
    const double before = std::exchange(residual, refinement.LargestResidual());
    if (residual <= kRefinedTolerance) return refinement.Result();
    if (refinement.IsExhausted() && (residual > before / 2 || round + 1 == kMaxRounds)) {
      return refinement.Result();
    }
    steps = round + 1 < kQuickRounds ? 1 : 2;
  }
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("modes could be found to a relative residual of ", residual,
                              " only; try a tenth more nodes (--nodes)"));
}

template absl::StatusOr<RefinedModes> RefineModes(
    const NodeMatrix&, const MultifrontalCholesky<float>&, const MatrixXd&,
    std::vector<VectorBlockOf<float>>, const RefinementPlan&, Workers&, const SolveProgress&);
template absl::StatusOr<RefinedModes> RefineModes(
    const NodeMatrix&, const MultifrontalCholesky<double>&, const MatrixXd&,
    std::vector<VectorBlockOf<double>>, const RefinementPlan&, Workers&, const SolveProgress&);

}  // namespace carillon::precompute
