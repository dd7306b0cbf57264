// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/eigen/eigensolver.h"

namespace carillon::precompute {

/// LAPACK's divide and conquer on full matrices: for small bodies, and where a good part of all
/// modes is wanted. Memory and time grow with the square and the cube of the unknowns.
class DenseEigensolver : public Eigensolver {
 public:
  absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                              const SolveProgress& progress) override;
};

}  // namespace carillon::precompute
