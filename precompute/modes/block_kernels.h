// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>

namespace carillon::precompute {

/// Rows of a packed panel that one tile holds: two nodes.
inline constexpr int kTileRows = 6;

/// One tile of a packed panel times kBlockWidth right-hand sides, chosen at run time for the
/// machine. The tile holds columns one after another, kTileRows numbers each. `y` has
/// `column_count` rows of kBlockWidth numbers; `x[0]` and `x[1]` point at three rows each, one
/// node.
///
///     TileForward:   x -= tile * y        TileBackward:   y -= tile^T * x
template <typename Real>
void TileForward(const Real* tile, int column_count, const Real* y, Real* const x[2]);
template <typename Real>
void TileBackward(const Real* tile, int column_count, Real* y, const Real* const x[2]);

/// y_i += B x_j and, off the diagonal, y_j += B^T x_i for the column j of a NodeMatrix: `count`
/// blocks B (3x3, row-major) with their nodes `rows`, the diagonal first. x and y: all nodes, 3
/// rows each.
void ColumnMultiply(const double* blocks, const int32_t* rows, int count, int j, const double* x,
                    double* y);

/// The same for a matrix m (x) I3.
void ColumnMultiplyScalar(const double* m, const int32_t* rows, int count, int j, const double* x,
                          double* y);

/// product = a^T b, kBlockWidth square, row-major; a and b: `rows` by kBlockWidth, row-major.
void BlockDot(const double* a, const double* b, int64_t rows, double* product);

/// x -= q h; q and x: `rows` by kBlockWidth, h square, all row-major.
void BlockSubtractTimes(const double* q, const double* h, int64_t rows, double* x);

}  // namespace carillon::precompute
