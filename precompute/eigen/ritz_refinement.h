// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/eigen/block_basis.h"
#include "precompute/eigen/block_gram.h"
#include "precompute/eigen/eigensolver.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

struct RefinementPlan {
  Eigen::Index wanted;  ///< number of modes wanted, the lowest of the rough ones
  int first_steps;      ///< number of corrections before the first projection of K and M
  /// Vectors with Rayleigh quotients below this are rigid-body motions, whose relative residuals
  /// are not defined.
  double free_motion;
};

/// Modes in elimination order, scaled as NodeMatrix is. The last block may have more vectors than
/// wanted.
struct RefinedModes {
  Eigen::VectorXd eigenvalues;
  VectorBlocks shapes;
};

/// Refines rough modes, found with a factor in Real, to double precision. Each vector is corrected
/// by x -= (K - shift M)^-1 (K - rho M) x, a step of inverse iteration in which the factor acts on
/// the residual only, so that the factor's rounding errors vanish. Then K and M are projected on
/// all vectors in double precision (Rayleigh-Ritz). Both steps are repeated until the residuals are
/// small.
///
/// `rough` has vectors in elimination order, and its last blocks may have more vectors than wanted.
/// Each block is freed as soon as it has been read. `deflated` is the same as for
/// LanczosRecurrence. `progress` is called in the calling thread. Errors: VERIFICATION_FAILED if
/// residuals stay large.
template <typename Real>
absl::StatusOr<RefinedModes> RefineModes(const NodeMatrix& A,
                                         const MultifrontalCholesky<Real>& factor,
                                         const Eigen::MatrixXd& deflated,
                                         std::vector<VectorBlockOf<Real>> rough,
                                         const RefinementPlan& plan, Workers& workers,
                                         const SolveProgress& progress);

}  // namespace carillon::precompute
