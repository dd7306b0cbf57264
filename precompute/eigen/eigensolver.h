// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// Solutions of K phi = Lambda M phi, ascending.
struct Modes {
  Eigen::VectorXd eigenvalues;  ///< 1/s^2
  Eigen::MatrixXd shapes;       ///< one row for each unknown; phi^T M phi = 1
};

/// A request for the lowest modes of a system, including rigid-body modes.
struct ModeRequest {
  /// Number of modes, at most the number of unknowns.
  int count;
  /// An upper bound near the highest eigenvalue wanted. This bound sets the scale of shifts.
  double eigenvalue_limit;
};

/// Called with the estimated fraction of the iteration that is done, 0 to 1.
using SolveProgress = std::function<void(double)>;

/// Finds the lowest modes of a body. A solver may miss modes; callers must verify the result.
class Eigensolver {
 public:
  virtual ~Eigensolver() = default;

  /// Returns exactly `request.count` modes. Errors: VERIFICATION_FAILED (did not converge),
  /// OUT_OF_MEMORY, MESH_TOO_LARGE.
  virtual absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                                      const SolveProgress& progress) = 0;
};

}  // namespace carillon::precompute
