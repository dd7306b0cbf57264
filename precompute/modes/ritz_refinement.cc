// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/ritz_refinement.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "precompute/modes/dense_blas.h"
#include "precompute/modes/verification.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// On |K phi - Lambda M phi| / |Lambda M phi|, Euclidean, in the unknowns of the user.
constexpr double kTolerance = 8e-7;

constexpr int kMaxRounds = 6;

/// After so many rounds, only vectors are left that hold something of modes not much above their
/// own, which each correction lessens by a third or so: two cost less than another projection.
constexpr int kQuickRounds = 2;

/// kBlockWidth vectors with their products.
struct Products {
  explicit Products(Index rows)
      : x(rows, kBlockWidth), elastic(rows, kBlockWidth), inertial(rows, kBlockWidth) {}

  VectorBlock x;
  VectorBlock elastic;
  VectorBlock inertial;
};

template <typename Real>
class Refinement {
 public:
  Refinement(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
             const MatrixXd& deflated, double free_motion, Workers& workers)
      : A_(A),
        factor_(factor),
        mass_(MakeMassRows<double>(A)),
        workers_(workers),
        free_motion_(free_motion),
        stiffest_(StiffestNode(A)),
        rows_(3 * static_cast<Index>(A.node_count)),
        deflated_(VectorBlock::Zero(rows_, kBlockWidth)) {
    deflated_.leftCols(deflated.cols()) = deflated;
  }

  void Take(const std::vector<VectorBlockOf<Real>>& rough) {
    x_.resize(rows_, static_cast<Index>(rough.size()) * kBlockWidth);
    for (size_t b = 0; b < rough.size(); ++b) {
      Columns(x_, static_cast<Index>(b)) = rough[b].template cast<double>();
    }
  }

  /// Corrects every block of vectors `steps` times, unless the first `wanted` vectors' of it are
  /// good already. What a vector takes up of the others Project takes out.
  void Correct(int steps, Index wanted) {
    elastic_.resize(rows_, x_.cols());
    if (!A_.mass_is_identity) inertial_.resize(rows_, x_.cols());
    const std::vector<bool> good = GoodBlocks(wanted);
    residuals_.resize(x_.cols());
    std::atomic<Index> next = 0;
    workers_.Run([&](int) {
      Products p(rows_);
      VectorBlockOf<Real> change(rows_, kBlockWidth);
      for (Index b = next++; b < x_.cols() / kBlockWidth; b = next++) {
        CorrectBlock(b, good[static_cast<size_t>(b)] ? 0 : steps, p, change);
      }
    });
  }

  /// x := x V with V from the projected problem.
  bool Project() {
    const MatrixXd& inertial = A_.mass_is_identity ? x_ : inertial_;
    MatrixXd stiffness = Gram(elastic_);
    MatrixXd mass = Gram(inertial);
    eigenvalues_.resize(x_.cols());
    const int size = static_cast<int>(x_.cols());
    if (!blas::GeneralizedEigen(size, stiffness.data(), mass.data(), eigenvalues_.data())) {
      return false;
    }
    MatrixXd rotated = MatrixXd::Zero(rows_, x_.cols());
    workers_.ForParts(rows_, 64, [&](int64_t begin, int64_t end, int) {
      blas::Product(static_cast<int>(end - begin), size, size, x_.data() + begin,
                    static_cast<int>(rows_), stiffness.data(), size, rotated.data() + begin,
                    static_cast<int>(rows_));
    });
    x_ = std::move(rotated);
    return true;
  }

  /// The largest residual of the first `wanted`.
  double LargestResidual(Index wanted) {
    residuals_.resize(x_.cols());
    std::atomic<Index> next = 0;
    workers_.Run([&](int) {
      Products p(rows_);
      for (Index b = next++; b < x_.cols() / kBlockWidth; b = next++) {
        Multiply(b, p);
        Subtract(b, p);
      }
    });
    return residuals_.head(wanted).maxCoeff();
  }

  /// Whether the residuals of the first `wanted` are small, or as small as rounding lets them be.
  bool IsDone(Index wanted) const {
    for (Index m = 0; m < wanted; ++m) {
      const double rounding = ResidualOfRounding(stiffest_, eigenvalues_[m]);
      if (!(residuals_[m] <= std::max(kTolerance, rounding))) return false;
    }
    return true;
  }

  Modes Result(Index wanted) const {
    return {.eigenvalues = eigenvalues_.head(wanted), .shapes = x_.leftCols(wanted)};
  }

 private:
  using Row = Eigen::Array<double, 1, kBlockWidth>;

  static auto Columns(MatrixXd& x, Index b) {
    return x.middleCols(b * kBlockWidth, Index{kBlockWidth});
  }

  /// None before residuals are known; those without a vector that is wanted are.
  std::vector<bool> GoodBlocks(Index wanted) const {
    std::vector<bool> good(static_cast<size_t>(x_.cols() / kBlockWidth), residuals_.size() != 0);
    for (Index i = 0; i < std::min(wanted, residuals_.size()); ++i) {
      if (!(residuals_[i] <= kTolerance)) good[static_cast<size_t>(i / kBlockWidth)] = false;
    }
    return good;
  }

  void MassTimes(const VectorBlock& x, VectorBlock& y) const {
    if (A_.mass_is_identity) {
      y = x;
      return;
    }
    Workers alone(1);
    MultiplyMass(mass_, alone, x.data(), y.data());
  }

  void Multiply(Index b, Products& p) {
    p.x = Columns(x_, b);
    MultiplyStiffness(A_, p.x.data(), p.elastic.data());
    MassTimes(p.x, p.inertial);
  }

  /// elastic -= inertial rho, with rho the Rayleigh quotients, and measures what is left.
  void Subtract(Index b, Products& p) {
    Row energy = Row::Zero();
    Row mass = Row::Zero();
    for (Index i = 0; i < rows_; ++i) {
      energy += p.x.row(i).array() * p.elastic.row(i).array();
      mass += p.x.row(i).array() * p.inertial.row(i).array();
    }
    const Row rho = energy / mass;
    Row residual = Row::Zero();
    Row scale = Row::Zero();
    for (Index i = 0; i < rows_; ++i) {
      const double root = A_.root_mass[static_cast<size_t>(i / 3)];
      p.elastic.row(i).array() -= rho * p.inertial.row(i).array();
      residual += (root * p.elastic.row(i).array()).square();
      scale += (root * p.inertial.row(i).array()).square();
    }
    const Row relative =
        (rho.abs() < free_motion_).select(0, (residual / scale).sqrt() / rho.abs());
    residuals_.segment<kBlockWidth>(b * kBlockWidth) = relative.matrix().transpose();
  }

  void CorrectBlock(Index b, int steps, Products& p, VectorBlockOf<Real>& change) {
    Workers alone(1);
    Multiply(b, p);
    for (int step = 0; step < steps; ++step) {
      Subtract(b, p);
      change = p.elastic.template cast<Real>();
      factor_.Solve(change.data(), alone);
      p.x -= change.template cast<double>();
      MassTimes(p.x, p.inertial);
      Deflate(p);
      MultiplyStiffness(A_, p.x.data(), p.elastic.data());
      MassTimes(p.x, p.inertial);
    }
    Columns(x_, b) = p.x;
    Columns(elastic_, b) = p.elastic;
    if (!A_.mass_is_identity) Columns(inertial_, b) = p.inertial;
  }

  void Deflate(Products& p) const {
    SmallBlock h;
    SmallBlock sum = SmallBlock::Zero();
    constexpr Index kStretch = 256;
    for (Index i = 0; i < rows_; i += kStretch) {
      const Index count = std::min(kStretch, rows_ - i);
      BlockDot(deflated_.data() + i * kBlockWidth, p.inertial.data() + i * kBlockWidth, count,
               h.data());
      sum += h;
    }
    BlockSubtractTimes(deflated_.data(), sum.data(), rows_, p.x.data());
  }

  /// x^T y, lower triangle.
  MatrixXd Gram(const MatrixXd& y) {
    MatrixXd gram = MatrixXd::Zero(x_.cols(), x_.cols());
    const Index strips = (x_.cols() + kStrip - 1) / kStrip;
    workers_.ForEach(strips, [&](int64_t strip) {
      const Index j = strip * kStrip;
      const auto width = static_cast<int>(std::min(kStrip, x_.cols() - j));
      blas::TransposedProduct(static_cast<int>(x_.cols() - j), width, static_cast<int>(rows_),
                              x_.col(j).data(), static_cast<int>(rows_), y.col(j).data(),
                              static_cast<int>(rows_), &gram(j, j), static_cast<int>(x_.cols()));
    });
    return gram;
  }

  static constexpr Index kStrip = 64;

  const NodeMatrix& A_;
  const MultifrontalCholesky<Real>& factor_;
  MassRows<double> mass_;
  Workers& workers_;
  double free_motion_;
  double stiffest_;
  Index rows_;
  VectorBlock deflated_;
  MatrixXd x_;
  MatrixXd elastic_;
  MatrixXd inertial_;
  VectorXd residuals_;
  VectorXd eigenvalues_;
};

}  // namespace

template <typename Real>
absl::StatusOr<Modes> RefineModes(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
                                  const MatrixXd& deflated,
                                  const std::vector<VectorBlockOf<Real>>& rough,
                                  const RefinementPlan& plan, Workers& workers) {
  Refinement<Real> refinement(A, factor, deflated, plan.free_motion, workers);
  refinement.Take(rough);
  double residual = 1;
  int steps = plan.first_steps;
  for (int round = 0; round < kMaxRounds; ++round) {
    refinement.Correct(steps, plan.wanted);
    if (!refinement.Project()) break;
    residual = refinement.LargestResidual(plan.wanted);
    if (refinement.IsDone(plan.wanted)) return refinement.Result(plan.wanted);
    steps = round + 1 < kQuickRounds ? 1 : 2;
  }
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("modes could be found to a relative residual of ", residual,
                              " only; another number of nodes may do"));
}

template absl::StatusOr<Modes> RefineModes(const NodeMatrix&, const MultifrontalCholesky<float>&,
                                           const MatrixXd&,
                                           const std::vector<VectorBlockOf<float>>&,
                                           const RefinementPlan&, Workers&);
template absl::StatusOr<Modes> RefineModes(const NodeMatrix&, const MultifrontalCholesky<double>&,
                                           const MatrixXd&,
                                           const std::vector<VectorBlockOf<double>>&,
                                           const RefinementPlan&, Workers&);

}  // namespace carillon::precompute
