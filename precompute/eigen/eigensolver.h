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
  Eigen::MatrixXd shapes;       ///< #U by #modes, phi^T M phi = 1
};

/// The lowest modes of a system, wanted whole: rigid-body modes included.
struct ModeRequest {
  /// How many; at most as many as there are unknowns.
  int count;
  /// An upper bound of about the size of the highest eigenvalue wanted; sets the scale of shifts.
  double eigenvalue_limit;
};

/// Called with the estimated part of the iteration that is done, 0 to 1.
using SolveProgress = std::function<void(double)>;

/// Finds the lowest modes of a body. Nothing is promised about modes missed: callers verify.
class Eigensolver {
 public:
  virtual ~Eigensolver() = default;

  /// Exactly `request.count` modes.
  /// Errors: VERIFICATION_FAILED (did not converge), OUT_OF_MEMORY, MESH_TOO_LARGE.
  virtual absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                                      const SolveProgress& progress) = 0;
};

}  // namespace carillon::precompute
