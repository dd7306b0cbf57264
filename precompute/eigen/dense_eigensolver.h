// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/eigen/eigensolver.h"

namespace carillon::precompute {

/// LAPACK's divide-and-conquer solver on full matrices, for small bodies and for requests of a
/// large part of all modes. Memory grows with the square and time with the cube of the number of
/// unknowns.
class DenseEigensolver : public Eigensolver {
 public:
  absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                              const SolveProgress& progress) override;
};

}  // namespace carillon::precompute
