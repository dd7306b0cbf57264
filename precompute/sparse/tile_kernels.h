// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/sparse/block_kernels.h"

namespace carillon::precompute {

/// Number of rows of a packed panel in one tile, which are the rows of two nodes.
inline constexpr int kTileRows = 6;

/// Number of right-hand sides that one pass over a factor in float can serve.
inline constexpr int kWideBlock = 2 * kBlockWidth;

/// These two functions multiply one tile of a packed panel by kWidth right-hand sides. kWidth is
/// kBlockWidth or, in float, kWideBlock. The variant for the machine is chosen at run time. The
/// tile stores its columns one after another, kTileRows numbers each. `y` has `column_count` rows
/// of kWidth numbers. `x[0]` and `x[1]` point at one node each, that is, at three rows.
///
///     TileForward:   x -= tile * y        TileBackward:   y -= tile^T * x
template <typename Real, int kWidth>
void TileForward(const Real* tile, int column_count, const Real* y, Real* const x[2]);
template <typename Real, int kWidth>
void TileBackward(const Real* tile, int column_count, Real* y, const Real* const x[2]);

/// These two functions compute x = D^-1 x and x = D^-T x, where D is the lower triangle of a
/// diagonal tile, whose diagonal is stored inverted. x has six rows.
template <typename Real, int kWidth>
void TileSolve(const Real* tile, Real* x);
template <typename Real, int kWidth>
void TileSolveTransposed(const Real* tile, Real* x);

}  // namespace carillon::precompute
