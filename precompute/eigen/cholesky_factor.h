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
  /// `lower`: lower triangle of A; `order`: pivot order, see OrderUnknowns.
  /// Errors: OUT_OF_MEMORY, MESH_TOO_LARGE, VERIFICATION_FAILED (A is not positive definite).
  static absl::StatusOr<CholeskyFactor> Make(const SystemMatrices::Sparse& lower,
                                             const std::vector<int>& order);
  CholeskyFactor(CholeskyFactor&&) noexcept;
  ~CholeskyFactor();

  /// X := L^-1 X, with rows in pivot order.
  void SolveL(Eigen::Ref<Eigen::MatrixXd> X) const;
  /// X := L^-T X, with rows in pivot order.
  void SolveLTransposed(Eigen::Ref<Eigen::MatrixXd> X) const;
  /// Element k is the unknown eliminated k-th. The order refines the given one.
  const std::vector<int>& order() const;

 private:
  struct Insides;
  explicit CholeskyFactor(std::unique_ptr<Insides> insides);
  std::unique_ptr<Insides> insides_;
};

}  // namespace carillon::precompute
