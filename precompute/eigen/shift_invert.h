// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/eigen/block_basis.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// y = -shift (K - shift M)^-1 x, by a factor in Real. A factor in float is as good as one for
/// another stiffness nearby, whose modes are others: so solves are followed by one for their
/// residual in double, in the first part of an iteration. How long that part is the error of the
/// first solve decides: a Krylov method may err the more the nearer it is to its end (Simoncini and
/// Szyld 2003), because what converged lies in the vectors before.
template <typename Real>
class ShiftInvert {
 public:
  using Block = VectorBlockOf<Real>;

  ShiftInvert(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
              const MassRows<Real>& mass, double shift, Workers& workers);

  /// x and y, in elimination order, may be one; `done`: the part of the iteration that is.
  void Apply(const Block& x, Block& y, double done);

  /// By how much the first solve was off, relatively; 0 in double.
  double error() const { return error_; }

 private:
  void Refine(const Block& x);

  const NodeMatrix& A_;
  const MultifrontalCholesky<Real>& factor_;
  const MassRows<Real>& mass_;
  double shift_;
  Workers& workers_;
  double refined_part_ = 1;  ///< of the iteration
  double error_ = 0;
  Block solution_;
  Block y_;
  VectorBlock elastic_;
  Block inertial_;
};

}  // namespace carillon::precompute
