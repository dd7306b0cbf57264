// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/eigen/eigensolver.h"
#include "precompute/sparse/ordered_system.h"

namespace carillon::precompute {

/// Block Lanczos with shift-invert and full re-orthogonalization (Grimes, Lewis and Simon 1994):
/// the Krylov space of (K - shift M)^-1 M, kBlockWidth vectors at a time, kept orthogonal to the
/// rigid-body modes, which are known in closed form. Blocks make it fast, because one pass over the
/// factor serves sixteen solves, and they find all modes of a degenerate group.
class BlockLanczosEigensolver : public Eigensolver {
 public:
  /// `ordered` is the system to be solved, in elimination order. `rigid` has the rigid-body modes
  /// as columns, at most six and M-orthonormal, with one row for each unknown. The solver refers to
  /// `ordered` and `rigid`, which must outlive it.
  BlockLanczosEigensolver(const OrderedSystem& ordered, const Eigen::MatrixXd& rigid)
      : ordered_(ordered), rigid_(rigid) {}

  absl::StatusOr<Modes> Solve(const SystemMatrices& system, const ModeRequest& request,
                              const SolveProgress& progress) override;

 private:
  const OrderedSystem& ordered_;
  const Eigen::MatrixXd& rigid_;
};

}  // namespace carillon::precompute
