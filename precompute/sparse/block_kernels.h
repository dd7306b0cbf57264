// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace carillon::precompute {

/// y_i += B x_j and, off the diagonal, y_j += B^T x_i for the column j of a NodeMatrix: `count`
/// blocks B (3x3, row-major) with their nodes `rows`, the diagonal first. x and y: all nodes, 3
/// rows each.
template <typename Real>
void ColumnMultiply(const double* blocks, const int32_t* rows, int count, int j, const Real* x,
                    double* y);

/// y = row of a matrix m (x) I3 times x: `count` numbers m in `columns`. x: all nodes, y: one, 3
/// rows each.
template <typename Real>
void RowMultiply(const Real* m, const int32_t* columns, int count, const Real* x, Real* y);

/// product = a^T b, kBlockWidth square, row-major; a and b: `rows` by kBlockWidth, row-major. A few
/// hundred rows at a time fit into the first-level cache, and their sums lose little precision in
/// float.
template <typename Real>
void BlockDot(const Real* a, const Real* b, int64_t rows, Real* product);

/// x -= q h; q and x: `rows` by kBlockWidth, h square, all row-major.
template <typename Real>
void BlockSubtractTimes(const Real* q, const Real* h, int64_t rows, Real* x);

}  // namespace carillon::precompute
