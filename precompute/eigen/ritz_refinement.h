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
  Eigen::Index wanted;  ///< the lowest of the rough ones
  int first_steps;      ///< corrections before K and M are projected for the first time
  /// Vectors with Rayleigh quotients below this bend nothing; their residuals have no measure.
  double free_motion;
};

/// In elimination order, scaled as NodeMatrix is; the last block may hold more than is wanted.
struct RefinedModes {
  Eigen::VectorXd eigenvalues;
  VectorBlocks shapes;
};

/// Makes good modes, in double precision, of rough ones found with a factor in Real: each is
/// corrected by x -= (K - shift M)^-1 (K - rho M) x, one step of inverse iteration in which the
/// factor acts on the residual only, so that its rounding fades; then K and M are projected on all
/// of them (Rayleigh and Ritz), in double. Repeated until residuals are small.
///
/// `rough`: in elimination order; the last blocks may hold more than is wanted; each is given back
/// as it is taken. `deflated`: as for LanczosRecurrence. `progress` is called in this thread.
/// Errors: VERIFICATION_FAILED where residuals stay large.
template <typename Real>
absl::StatusOr<RefinedModes> RefineModes(const NodeMatrix& A,
                                         const MultifrontalCholesky<Real>& factor,
                                         const Eigen::MatrixXd& deflated,
                                         std::vector<VectorBlockOf<Real>> rough,
                                         const RefinementPlan& plan, Workers& workers,
                                         const SolveProgress& progress);

}  // namespace carillon::precompute
