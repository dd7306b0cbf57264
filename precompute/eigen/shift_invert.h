// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/eigen/block_basis.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/node_matrix.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Computes y = -shift (K - shift M)^-1 x with a factor in Real. A factor in float equals the exact
/// factor of a slightly different stiffness, which has different modes. In the first part of an
/// iteration each solve is therefore followed by a solve for its residual, computed in double. The
/// error of the first solve determines the length of that part: a Krylov method tolerates larger
/// errors the nearer it is to its end (Simoncini and Szyld 2003), because converged directions
/// already lie in the basis.
template <typename Real>
class ShiftInvert {
 public:
  using Block = VectorBlockOf<Real>;

  ShiftInvert(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor,
              const MassRows<Real>& mass, double shift, Workers& workers);

  /// x and y are in elimination order and may be the same object. `done` is the fraction of
  /// the iteration that is done.
  void Apply(const Block& x, Block& y, double done);

  /// Returns the relative error of the first solve; 0 in double.
  double error() const { return error_; }

 private:
  void Refine(const Block& x);

  const NodeMatrix& A_;
  const MultifrontalCholesky<Real>& factor_;
  const MassRows<Real>& mass_;
  double shift_;
  Workers& workers_;
  double refined_part_ = 1;  ///< fraction of the iteration in which solves are refined
  double error_ = 0;
  Block solution_;
  Block y_;
  VectorBlock elastic_;
  Block inertial_;
};

}  // namespace carillon::precompute
