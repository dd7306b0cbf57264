// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/sparse/node_matrix.h"

namespace carillon::precompute {

/// Rows of a packed panel that one tile holds: two nodes.
inline constexpr int kTileRows = 6;

/// Number of right-hand sides that one pass over a factor in float can serve.
inline constexpr int kWideBlock = 2 * kBlockWidth;

/// One tile of a packed panel times kWidth right-hand sides, chosen at run time for the machine:
/// kBlockWidth, and in float kWideBlock. The tile holds columns one after another, kTileRows
/// numbers each. `y` has `column_count` rows of kWidth numbers; `x[0]` and `x[1]` point at three
/// rows each, one node.
///
///     TileForward:   x -= tile * y        TileBackward:   y -= tile^T * x
template <typename Real, int kWidth>
void TileForward(const Real* tile, int column_count, const Real* y, Real* const x[2]);
template <typename Real, int kWidth>
void TileBackward(const Real* tile, int column_count, Real* y, const Real* const x[2]);

/// x = D^-1 x and x = D^-T x for the lower triangle D of a diagonal tile (its diagonal inverted);
/// x: six rows.
template <typename Real, int kWidth>
void TileSolve(const Real* tile, Real* x);
template <typename Real, int kWidth>
void TileSolveTransposed(const Real* tile, Real* x);

}  // namespace carillon::precompute
