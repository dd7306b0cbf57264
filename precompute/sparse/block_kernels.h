// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace carillon::precompute {

/// Number of vectors in a block of the solver: two AVX-512 registers of doubles for each row.
inline constexpr int kBlockWidth = 16;

/// Adds the product with column j of a NodeMatrix: y_i += B x_j and, off the diagonal, y_j += B^T
/// x_i. The column has `count` blocks B (3x3, row-major) with their nodes in `rows`, the diagonal
/// first. x and y have 3 rows for each node.
template <typename Real>
void ColumnMultiply(const double* blocks, const int32_t* rows, int count, int j, const Real* x,
                    double* y);

/// Computes y, the product of one row of a matrix m (x) I3 and x. The row has `count` numbers m in
/// these `columns`. x has 3 rows for each node, and y has 3 rows.
template <typename Real>
void RowMultiply(const Real* m, const int32_t* columns, int count, const Real* x, Real* y);

/// Computes product = a^T b, kBlockWidth square. a and b are `rows` by kBlockWidth, and all arrays
/// are row-major. Callers pass a few hundred rows at a time, which fit into the first-level cache
/// and whose sums lose little precision in float.
template <typename Real>
void BlockDot(const Real* a, const Real* b, int64_t rows, Real* product);

/// Computes x -= q h. q and x are `rows` by kBlockWidth, and h is square; all are row-major.
template <typename Real>
void BlockSubtractTimes(const Real* q, const Real* h, int64_t rows, Real* x);

}  // namespace carillon::precompute
