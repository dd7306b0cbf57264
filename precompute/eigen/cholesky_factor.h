// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/fem/assembly.h"

namespace carillon::precompute {

/// The supernodal factorization P A P^T = L L^T of a symmetric positive definite matrix A.
class CholeskyFactor {
 public:
  /// Factorizes A, of which `lower` is the lower triangle. `order` is the pivot order, see
  /// OrderUnknowns.
  /// Errors: OUT_OF_MEMORY, MESH_TOO_LARGE, VERIFICATION_FAILED (A is not positive definite).
  static absl::StatusOr<CholeskyFactor> Make(const SystemMatrices::Sparse& lower,
                                             const std::vector<int>& order);
  CholeskyFactor(CholeskyFactor&&) noexcept;
  ~CholeskyFactor();

  /// Computes X := L^-1 X. Rows are in pivot order.
  void SolveL(Eigen::Ref<Eigen::MatrixXd> X) const;
  /// Computes X := L^-T X. Rows are in pivot order.
  void SolveLTransposed(Eigen::Ref<Eigen::MatrixXd> X) const;
  /// Returns the pivot order, a refinement of the given order. Element k is the unknown eliminated
  /// k-th.
  const std::vector<int>& order() const;

 private:
  struct Insides;
  explicit CholeskyFactor(std::unique_ptr<Insides> insides);
  std::unique_ptr<Insides> insides_;
};

}  // namespace carillon::precompute
