// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <type_traits>

#include "precompute/modes/block_basis.h"
#include "precompute/modes/multifrontal_cholesky.h"
#include "precompute/modes/node_matrix.h"
#include "precompute/modes/workers.h"

namespace carillon::precompute {

/// y = -shift (K - shift M)^-1 x, by a factor in Real. A factor in float is as good as one for
/// another stiffness nearby, whose modes are others: where the first solve finds that far off, each
/// solve is followed by one for its residual in double.
template <typename Real>
class ShiftInvert {
 public:
  using Block = VectorBlockOf<Real>;

  ShiftInvert(const NodeMatrix& A, const MultifrontalCholesky<Real>& factor, double shift,
              Workers& workers);

  /// x and y, in elimination order, may be one.
  void Apply(const Block& x, Block& y);

  /// Whether solves are good to more than the precision of a factor in float.
  bool exact() const { return refines_ || std::is_same_v<Real, double>; }

 private:
  double Refine(const Block& x);

  const NodeMatrix& A_;
  const MultifrontalCholesky<Real>& factor_;
  double shift_;
  Workers& workers_;
  MassRows<double> mass_;
  bool measured_ = false;
  bool refines_ = false;
  Block solution_;
  VectorBlock y_;
  VectorBlock elastic_;
  VectorBlock inertial_;
};

}  // namespace carillon::precompute
