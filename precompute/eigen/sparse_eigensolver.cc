// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/sparse_eigensolver.h"

#include <Spectra/SymEigsSolver.h>

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <exception>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/cholesky_factor.h"
#include "precompute/eigen/solve_cost.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Sparse = SystemMatrices::Sparse;
using Permutation = Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int>;

/// Shift relative to the highest eigenvalue wanted: a tenth of its frequency. Measured: the time
/// does not depend on it within a factor of ten of frequency.
constexpr double kRelativeShift = -0.01;

constexpr double kSpectraTolerance = 1e-9;
constexpr int kMaxRestarts = 100;

/// The permutation that brings unknowns into pivot order: row k of P x is x[order[k]].
Permutation IntoPivotOrder(const std::vector<int>& order) {
  Permutation permutation(static_cast<Eigen::Index>(order.size()));
  for (size_t k = 0; k < order.size(); ++k) {
    permutation.indices()[order[k]] = static_cast<int>(k);
  }
  return permutation;
}

/// y = L^-1 P M P^T L^-T x, in the form that Spectra calls.
class InverseOperator {
 public:
  using Scalar = double;

  InverseOperator(const CholeskyFactor& factor, const Sparse& mass, const SolveProgress& progress,
                  int expected_count)
      : factor_(factor), progress_(progress), expected_count_(expected_count) {
    const Permutation P = IntoPivotOrder(factor.order());
    M_ = mass.selfadjointView<Eigen::Lower>().twistedBy(P);
  }

  Eigen::Index rows() const { return M_.rows(); }
  Eigen::Index cols() const { return M_.rows(); }

  void perform_op(const double* x_in, double* y_out) const {
    work_ = Eigen::Map<const Eigen::VectorXd>(x_in, rows());
    factor_.SolveLTransposed(work_);
    Eigen::Map<Eigen::VectorXd> y(y_out, rows());
    y.noalias() = M_ * work_;
    factor_.SolveL(y);
    // The estimate does not include restarts: it approaches 1 without reaching it.
    const double work = static_cast<double>(++count_) / expected_count_;
    progress_(work < 0.5 ? work : 1 - 0.25 / work);
  }

 private:
  const CholeskyFactor& factor_;
  const SolveProgress& progress_;
  int expected_count_;
  Sparse M_;
  mutable Eigen::MatrixXd work_;
  mutable int count_ = 0;
};

absl::Status NotConverged(int count) {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat("the iteration for ", count,
                              " modes did not converge; another number of nodes may do"));
}

absl::Status TooFewUnknowns(const SystemMatrices& system, int count) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("Spectra cannot find ", count, " modes of ", system.unknown_count(),
                              " unknowns: it needs more unknowns than modes; use the solver "
                              "block-lanczos, more nodes, or a lower band"));
}

/// phi = P^T L^-T y, M-normalised.
Modes MakeModes(const CholeskyFactor& factor, const Sparse& mass, double shift,
                const Eigen::VectorXd& nu, Eigen::MatrixXd y) {
  factor.SolveLTransposed(y);
  Modes modes{.eigenvalues = nu.cwiseInverse().array() + shift,
              .shapes = IntoPivotOrder(factor.order()).transpose() * y};
  for (Eigen::Index m = 0; m < modes.shapes.cols(); ++m) {
    auto shape = modes.shapes.col(m);
    shape /= std::sqrt(shape.dot(mass.selfadjointView<Eigen::Lower>() * shape));
  }
  return modes;
}

}  // namespace

absl::StatusOr<Modes> SparseEigensolver::Solve(const SystemMatrices& system,
                                               const ModeRequest& request,
                                               const SolveProgress& progress) {
  if (request.count >= system.unknown_count()) return TooFewUnknowns(system, request.count);
  const double shift = kRelativeShift * request.eigenvalue_limit;
  const Sparse shifted = system.K - shift * system.M;
  ASSIGN_OR_RETURN(const CholeskyFactor factor, CholeskyFactor::Make(shifted, order_));
  progress(0);
  const int basis =
      std::min(static_cast<int>(system.unknown_count()), SpectraBasisSize(request.count));
  try {
    InverseOperator inverse(factor, system.M, progress, basis + request.count);
    Spectra::SymEigsSolver<InverseOperator> lanczos(inverse, request.count, basis);
    lanczos.init();
    lanczos.compute(Spectra::SortRule::LargestAlge, kMaxRestarts, kSpectraTolerance);
    if (lanczos.info() != Spectra::CompInfo::Successful) return NotConverged(request.count);
    return MakeModes(factor, system.M, shift, lanczos.eigenvalues(), lanczos.eigenvectors());
  } catch (const std::bad_alloc&) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
        "the memory does not suffice for the modes; ask for fewer nodes or a lower band");
  } catch (const std::exception&) {
    return NotConverged(request.count);
  }
}

}  // namespace carillon::precompute
