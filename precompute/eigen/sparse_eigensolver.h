// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <utility>
#include <vector>

#include "precompute/eigen/eigensolver.h"

namespace carillon::precompute {

/// A solver that uses the library Spectra with CHOLMOD's factorization, as an independent check. It
/// shares neither the iteration nor the factorization with BlockLanczosEigensolver. It needs more
/// unknowns than modes.
///
/// The method is shift-invert Lanczos with a small negative shift sigma. K - sigma M = L L^T is
/// then positive definite although K has six null vectors. The largest eigenvalues nu of L^-1 M
/// L^-T give the lowest Lambda = sigma + 1/nu. (A shift of zero is known to lose one mode of a
/// degenerate pair.)
class SparseEigensolver : public Eigensolver {
 public:
  /// `order` is the pivot order of the unknowns, see OrderUnknowns.
  explicit SparseEigensolver(std::vector<int> order) : order_(std::move(order)) {}

  absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                              const SolveProgress& progress) override;

 private:
  std::vector<int> order_;
};

}  // namespace carillon::precompute
