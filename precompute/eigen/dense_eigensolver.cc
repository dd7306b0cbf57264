// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/dense_eigensolver.h"

#include <lapacke.h>

#include <new>

#include "absl/strings/str_cat.h"
#include "precompute/sparse/openblas.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {

absl::StatusOr<Modes> DenseEigensolver::Solve(const SystemMatrices& system,
                                              const ModeRequest& request,
                                              const SolveProgress& /*progress*/) {
  try {
    Eigen::MatrixXd K = system.K;
    Eigen::MatrixXd M = system.M;
    Eigen::VectorXd eigenvalues(K.rows());
    const auto size = static_cast<lapack_int>(K.rows());
    const ScopedBlasThreads threads(ThreadCount());
    const lapack_int info = LAPACKE_dsygvd(LAPACK_COL_MAJOR, 1, 'V', 'L', size, K.data(), size,
                                           M.data(), size, eigenvalues.data());
    if (info == LAPACK_WORK_MEMORY_ERROR) throw std::bad_alloc();
    if (info != 0) {
      return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                     absl::StrCat("the dense eigensolver ended with code ", info,
                                  "; try a tenth more nodes (--nodes)"));
    }
    return Modes{.eigenvalues = eigenvalues.head(request.count),
                 .shapes = K.leftCols(request.count)};
  } catch (const std::bad_alloc&) {
    return Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                   absl::StrCat("the memory does not suffice for the dense solution of ",
                                system.unknown_count(), " unknowns; ask for fewer nodes"));
  }
}

}  // namespace carillon::precompute
