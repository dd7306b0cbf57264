// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "precompute/eigen/eigensolver.h"

namespace carillon::precompute {

/// The library Spectra with CHOLMOD's factorization, as a second opinion: nothing of the iteration
/// or the factorization is shared with BlockLanczosEigensolver. It needs more unknowns than modes.
///
/// Shift-invert Lanczos with a small negative shift sigma: K - sigma M = L L^T is positive definite
/// though K has six null vectors, and the largest eigenvalues nu of L^-1 M L^-T give the lowest
/// Lambda = sigma + 1/nu. (A shift of zero is known to lose one of a degenerate pair.)
class SparseEigensolver : public Eigensolver {
 public:
  /// `order`: pivot order of the unknowns, see OrderUnknowns.
  explicit SparseEigensolver(std::vector<int> order) : order_(std::move(order)) {}

  absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                              const SolveProgress& progress) override;

 private:
  std::vector<int> order_;
};

}  // namespace carillon::precompute
