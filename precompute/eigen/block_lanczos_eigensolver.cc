// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/block_lanczos_eigensolver.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/block_lanczos.h"
#include "precompute/eigen/ritz_refinement.h"
#include "precompute/eigen/solve_cost.h"
#include "precompute/sparse/dense_blas.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/openblas.h"
#include "precompute/sparse/workers.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Limit of |OP y - theta y| / theta. Refinement removes the remaining error.
constexpr double kTolerance = 1e-6;

/// Least number of Ritz vectors to refine beyond the wanted ones. Rounding in float mixes
/// neighbouring modes, and refinement separates only modes among the vectors that it is given.
constexpr Index kGuards = 4;

/// The shift, as a part of the highest eigenvalue wanted: 5 kHz for a band to 20 kHz. The number of
/// iterations hardly depends on it, and a larger shift loses fewer digits.
constexpr double kShift = -0.0625;

/// Approximate fraction of the solution's time that the iteration takes.
constexpr double kIterationPart = 0.6;

/// Numbers of corrections before K and M are projected for the first time. If solves have a larger
/// error than this limit, one correction gains little until the projection has separated modes that
/// are mixed with each other.
constexpr int kFirstSteps = 2;
constexpr double kLargeSolveError = 5e-4;

/// Eigenvalues below this fraction of the shift are zero except for rounding.
constexpr double kFreeMotion = 1e-7;

/// Converts vectors `x` of the user's unknowns to those of NodeMatrix, and back.
MatrixXd ToNodeOrder(const MatrixXd& x, const OrderedSystem& ordered) {
  MatrixXd y(x.rows(), x.cols());
  for (size_t i = 0; i < ordered.fronts.order.size(); ++i) {
    y.middleRows<3>(3 * static_cast<Index>(i)) =
        x.middleRows<3>(3 * static_cast<Index>(ordered.fronts.order[i])) *
        ordered.matrix.root_mass[i];
  }
  return y;
}
void FromNodeOrder(const VectorBlocks& y, const OrderedSystem& ordered, Workers& workers,
                   Eigen::Ref<MatrixXd> x) {
  const std::vector<int32_t> position = Inverse(ordered.fronts.order);
  workers.ForEach((x.cols() + kBlockWidth - 1) / kBlockWidth, [&](int64_t b) {
    const Index first = b * kBlockWidth;
    const Index width = std::min<Index>(kBlockWidth, x.cols() - first);
    for (size_t node = 0; node < position.size(); ++node) {
      const double scale = 1 / ordered.matrix.root_mass[static_cast<size_t>(position[node])];
      for (Index a = 0; a < 3; ++a) {
        const double* from = &y[static_cast<size_t>(b)](3 * Index{position[node]} + a, 0);
        double* to = &x(3 * static_cast<Index>(node) + a, first);
        for (Index c = 0; c < width; ++c) to[c * x.outerStride()] = scale * from[c];
      }
    }
  });
}

/// The Ritz pairs of a recurrence, in ascending order of Lambda.
struct RitzPairs {
  MatrixXd coordinates;
  int converged_count = 0;
};

template <typename Real>
RitzPairs FindRitzPairs(const LanczosRecurrence<Real>& recurrence, Index wanted) {
  MatrixXd T = recurrence.T();
  VectorXd theta(T.rows());
  RitzPairs pairs;
  if (!blas::SymmetricEigen(static_cast<int>(T.rows()), T.data(), theta.data())) return pairs;
  const Index padded = (wanted + kGuards + kBlockWidth - 1) / kBlockWidth * kBlockWidth;
  pairs.coordinates = T.rightCols(std::min(padded, T.cols())).rowwise().reverse();
  for (Index i = 0; i < wanted; ++i) {
    const double off = recurrence.Remainder(pairs.coordinates.col(i).tail(kBlockWidth));
    if (!(off < kTolerance * theta[T.rows() - 1 - i])) break;
    ++pairs.converged_count;
  }
  return pairs;
}

absl::Status NotConverged(int converged, Index wanted) {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("the eigenvalue iteration found ", converged, " of ", wanted,
                              " modes; try a tenth more nodes (--nodes)"));
}

/// Steps until `wanted` Ritz pairs have converged.
template <typename Real>
absl::StatusOr<RitzPairs> Iterate(LanczosRecurrence<Real>& recurrence, Index wanted, Index largest,
                                  const SolveProgress& progress) {
  RitzPairs pairs;
  bool open = recurrence.Start();
  progress(0);
  // The cost of a convergence test grows with the cube of the basis size. From three halves of the
  // wanted number on, two more vectors give about one more converged pair.
  for (Index look = 3 * wanted / 2 + 3 * kBlockWidth; pairs.converged_count < wanted;) {
    if (!open || recurrence.size() + kBlockWidth > largest) {
      return NotConverged(pairs.converged_count, wanted);
    }
    open = recurrence.Step();
    progress(kIterationPart * recurrence.done());
    if (open && recurrence.size() < look) continue;
    pairs = FindRitzPairs(recurrence, wanted);
    const Index missing = wanted - pairs.converged_count;
    look = recurrence.size() + std::max<Index>(kBlockWidth, missing);
  }
  return pairs;
}

template <typename Real>
absl::StatusOr<RefinedModes> SolveIn(const OrderedSystem& ordered, const MatrixXd& rigid,
                                     double shift, Index wanted, Workers& workers,
                                     const SolveProgress& progress) {
  ASSIGN_OR_RETURN(const auto factor, MultifrontalCholesky<Real>::Factorize(
                                          ordered.fronts, ordered.matrix, shift, workers, nullptr));
  std::vector<VectorBlockOf<Real>> rough;
  int first_steps = 1;
  {
    const double expected_size = PredictBasisSize(static_cast<int>(wanted));
    LanczosRecurrence<Real> recurrence(ordered.matrix, factor, shift, rigid, expected_size,
                                       workers);
    const Index largest = std::min<Index>(
        3 * static_cast<Index>(ordered.matrix.node_count) - rigid.cols(), 10 * wanted + 500);
    ASSIGN_OR_RETURN(const RitzPairs pairs, Iterate(recurrence, wanted, largest, progress));
    rough = recurrence.Combine(pairs.coordinates);
    const double error = recurrence.solve_error();
    if (error > 0 && error < kLargeSolveError) first_steps = kFirstSteps;
  }
  return RefineModes(
      ordered.matrix, factor, rigid, std::move(rough),
      {.wanted = wanted, .first_steps = first_steps, .free_motion = -kFreeMotion * shift}, workers,
      [&](double done) { progress(kIterationPart + (1 - kIterationPart) * done); });
}

}  // namespace

absl::StatusOr<Modes> BlockLanczosEigensolver::Solve(const SystemMatrices& system,
                                                     const ModeRequest& request,
                                                     const SolveProgress& progress) {
  const Index wanted = request.count - rigid_.cols();
  const double shift = kShift * request.eigenvalue_limit;
  const MatrixXd rigid = ToNodeOrder(rigid_, ordered_);
  Workers workers(ThreadCount());
  absl::StatusOr<RefinedModes> bent =
      SolveIn<float>(ordered_, rigid, shift, wanted, workers, progress);
  // Double precision may succeed where float fails, for example with elements that are nearly flat.
  if (!bent.ok()) bent = SolveIn<double>(ordered_, rigid, shift, wanted, workers, progress);
  if (!bent.ok()) return bent.status();
  Modes modes;
  modes.eigenvalues.resize(request.count);
  const MatrixXd elastic = system.K.selfadjointView<Eigen::Lower>() * rigid_;
  modes.eigenvalues.head(rigid_.cols()) = rigid_.cwiseProduct(elastic).colwise().sum().transpose();
  modes.eigenvalues.tail(wanted) = bent->eigenvalues;
  modes.shapes.resize(system.unknown_count(), request.count);
  modes.shapes.leftCols(rigid_.cols()) = rigid_;
  FromNodeOrder(bent->shapes, ordered_, workers, modes.shapes.rightCols(wanted));
  return modes;
}

}  // namespace carillon::precompute
