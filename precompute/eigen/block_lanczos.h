// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "precompute/eigen/block_basis.h"
#include "precompute/eigen/shift_invert.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The block Lanczos recurrence (Golub and Underwood 1977) with full re-orthogonalization,
///
///     OP q_j = q_{j-1} R_j^T + q_j H_j + q_{j+1} R_{j+1},   OP = -shift (K - shift M)^-1 M,
///
/// in the inner product of M, kept orthogonal to the deflated vectors. The eigenvalues of OP lie
/// between 0 and 1. A mode with eigenvalue Lambda has theta = shift / (shift - Lambda).
template <typename Real>
class LanczosRecurrence {
 public:
  using Block = VectorBlockOf<Real>;

  /// `deflated` has at most kBlockWidth vectors, M-orthonormal, in elimination order.
  /// `expected_size` is the predicted size of the basis at the end. The objects referred to must
  /// outlive this one.
  LanczosRecurrence(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor, double shift,
                    const Eigen::MatrixXd& deflated, double expected_size, Workers& workers);

  /// Makes the first block from random vectors with a fixed seed, so that a body gives the same
  /// model each time.
  bool Start();

  /// Adds one block to the basis and to T. Returns false if the Krylov space is exhausted in the
  /// precision of Real.
  bool Step();

  int size() const { return basis_.size(); }
  double solve_error() const { return operator_.error(); }
  /// Returns the estimated fraction of the iteration that is done.
  double done() const { return std::min(1.0, size() / expected_size_); }

  /// Returns the projection of OP on the basis. It is block-tridiagonal and size() square.
  Eigen::MatrixXd T() const;

  /// Returns |R s|, the norm of OP y - theta y for a Ritz vector y = Q s. `last` is the last
  /// kBlockWidth components of s.
  double Remainder(const Eigen::Ref<const Eigen::VectorXd>& last) const {
    return (R_ * last).norm();
  }

  /// Returns Q s in blocks. s has size() rows, and a multiple of kBlockWidth columns.
  std::vector<Block> Combine(const Eigen::MatrixXd& s) const { return basis_.Combine(s); }

 private:
  const Block& MassTimes(const Block& x);
  void Orthogonalize();
  bool Normalize();
  void TimesRight(const SmallBlock& u, Block& x);

  Workers& workers_;
  double expected_size_;
  MassRows<Real> mass_;
  ShiftInvert<Real> operator_;
  bool mass_is_identity_;
  Eigen::Index rows_;
  BlockBasis<Real> deflated_;
  BlockBasis<Real> basis_;
  Block next_;
  Block mass_times_;
  SmallBlock R_ = SmallBlock::Zero();
  std::vector<SmallBlock> diagonal_;
  std::vector<SmallBlock> below_;
};

}  // namespace carillon::precompute
