// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/multifrontal_cholesky.h"

#include <algorithm>
#include <array>
#include <vector>

#include "precompute/modes/block_kernels.h"
#include "precompute/modes/dense_blas.h"
#include "precompute/modes/strips.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

int TileCount(int rows) { return (rows + kTileRows - 1) / kTileRows; }

size_t PackedSize(int pivots, int updates) {
  const size_t tiles = static_cast<size_t>(TileCount(pivots));
  const size_t triangle = kTileRows * kTileRows * tiles * (tiles + 1) / 2;
  return triangle +
         static_cast<size_t>(TileCount(updates)) * kTileRows * static_cast<size_t>(pivots);
}

/// Rows of the panel from `row`, columns [0, columns), as one tile; rows beyond `row_end` are zero.
template <typename Real>
Real* PackTile(const Front<Real>& front, int row, int row_end, int columns, Real* tile) {
  const int count = std::min(kTileRows, row_end - row);
  for (int c = 0; c < columns; ++c, tile += kTileRows) {
    const Real* from = &front.panel[static_cast<size_t>(c) * front.height() + row];
    std::fill(std::copy(from, from + count, tile), tile + kTileRows, Real{0});
  }
  return tile;
}

/// The pivot tiles, each with the columns left of its diagonal block and then that block with its
/// diagonal inverted, then the tiles below.
template <typename Real>
void PackPanel(const Front<Real>& front, Real* out) {
  for (int row = 0; row < front.pivots; row += kTileRows) {
    out = PackTile(front, row, front.pivots, row, out);
    for (int c = 0; c < kTileRows; ++c) {
      for (int r = 0; r < kTileRows; ++r, ++out) {
        const bool inside = row + r < front.pivots && row + c < front.pivots && r >= c;
        const Real l = inside ? front.panel[static_cast<size_t>(row + c) * front.height() + row + r]
                              : Real{r == c ? 1.0F : 0.0F};
        *out = r == c ? 1 / l : l;
      }
    }
  }
  for (int row = front.pivots; row < front.height(); row += kTileRows) {
    out = PackTile(front, row, front.height(), front.pivots, out);
  }
}

absl::Status NotPositiveDefinite() {
  return Refusal(
      absl::StatusCode::kInternal, "VERIFICATION_FAILED",
      "the shifted stiffness matrix is not positive definite in working precision: the mesh "
      "has elements too flat to compute with; mesh it anew with better-shaped elements");
}

/// The columns of the panel, kPanel at a time, rows shared out.
template <typename Real>
bool FactorizePanel(Front<Real>& front, Workers& workers) {
  constexpr int kPanel = 192;
  const int h = front.height();
  const int p = front.pivots;
  for (int k = 0; k < p; k += kPanel) {
    const int width = std::min(kPanel, p - k);
    Real* block = front.panel.data() + static_cast<ptrdiff_t>(k) * (h + 1);
    if (!blas::Cholesky(width, block, h)) return false;
    workers.ForParts(h - k - width, kTileRows, [&](int64_t begin, int64_t end, int) {
      blas::SolveRight(static_cast<int>(end - begin), width, block, h, block + width + begin, h,
                       false);
    });
    const int rest = h - k - width;
    const int later = p - k - width;
    Real* L = block + width;
    ForStrips(workers, later, [&](int j, int columns) {
      blas::SubtractProduct(rest - j, columns, width, L + j, h, L + j, h,
                            L + static_cast<ptrdiff_t>(width + j) * h + j, h);
    });
  }
  return true;
}

template <typename Real>
absl::Status EliminateCholesky(Front<Real>& front, Workers& workers) {
  const int h = front.height();
  const int p = front.pivots;
  const int u = front.updates;
  if (!FactorizePanel(front, workers)) return NotPositiveDefinite();
  const Real* below = front.panel.data() + p;
  if (workers.count() == 1) {
    if (u > 0) blas::SubtractSquare(u, p, below, h, front.update, u);
    return absl::OkStatus();
  }
  ForStrips(workers, u, [&](int j, int columns) {
    blas::SubtractProduct(u - j, columns, p, below + j, h, below + j, h,
                          front.update + static_cast<ptrdiff_t>(j) * (u + 1), u);
  });
  return absl::OkStatus();
}

}  // namespace

template <typename Real>
absl::StatusOr<MultifrontalCholesky<Real>> MultifrontalCholesky<Real>::Factorize(
    const FrontalStructure& fronts, const NodeMatrix& A, double shift, Workers& workers,
    const PartDone& progress) {
  MultifrontalCholesky factor;
  factor.fronts_ = &fronts;
  factor.tile_start_.push_back(0);
  for (int s = 0; s < fronts.supernode_count(); ++s) {
    factor.tile_start_.push_back(factor.tile_start_.back() +
                                 PackedSize(fronts.pivot_count(s), fronts.update_count(s)));
  }
  factor.tiles_.resize(factor.tile_start_.back());
  const auto eliminate = [&](int s, Front<Real>& front, Workers& sharing) {
    absl::Status status = EliminateCholesky(front, sharing);
    if (status.ok()) PackPanel(front, &factor.tiles_[factor.tile_start_[s]]);
    return status;
  };
  FrontWalk<Real, decltype(eliminate)> walk(fronts, A, shift, eliminate, workers);
  if (absl::Status status = walk.Run(progress); !status.ok()) return status;
  return factor;
}

namespace {

/// x = D^-1 x for the lower triangle D of a diagonal tile (its diagonal inverted), six rows.
template <typename Real>
void SolveTile(const Real* tile, Real* x) {
  for (int c = 0; c < kTileRows; ++c) {
    Real* xc = x + c * kBlockWidth;
    for (int k = 0; k < kBlockWidth; ++k) xc[k] *= tile[c * kTileRows + c];
    for (int r = c + 1; r < kTileRows; ++r) {
      const Real l = tile[c * kTileRows + r];
      Real* xr = x + r * kBlockWidth;
      for (int k = 0; k < kBlockWidth; ++k) xr[k] -= l * xc[k];
    }
  }
}

template <typename Real>
void SolveTileTransposed(const Real* tile, Real* x) {
  for (int c = kTileRows - 1; c >= 0; --c) {
    Real* xc = x + c * kBlockWidth;
    for (int r = c + 1; r < kTileRows; ++r) {
      const Real l = tile[c * kTileRows + r];
      const Real* xr = x + r * kBlockWidth;
      for (int k = 0; k < kBlockWidth; ++k) xc[k] -= l * xr[k];
    }
    for (int k = 0; k < kBlockWidth; ++k) xc[k] *= tile[c * kTileRows + c];
  }
}

/// A diagonal tile may be half full: its rows are copied out and back, absent ones zero.
template <typename Real, typename TileSolve>
void WithTileRows(Real* x, int rows, const TileSolve& solve) {
  if (rows >= kTileRows) {
    solve(x);
    return;
  }
  std::array<Real, kTileRows * kBlockWidth> copy{};
  std::copy(x, x + rows * kBlockWidth, copy.begin());
  solve(copy.data());
  std::copy(copy.begin(), copy.begin() + rows * kBlockWidth, x);
}

}  // namespace

template <typename Real>
void MultifrontalCholesky<Real>::Solve(Real* x) const {
  constexpr ptrdiff_t kNode = 3 * kBlockWidth;
  const FrontalStructure& fronts = *fronts_;
  Real* const scratch = x + static_cast<ptrdiff_t>(fronts.order.size()) * kNode;
  std::fill(scratch, scratch + kNode, Real{0});
  const auto below = [&](int s, const auto& visit) {
    const int64_t end = fronts.row_start[s + 1];
    int64_t r = fronts.row_start[s] + fronts.first_pivot[s + 1] - fronts.first_pivot[s];
    for (; r < end; r += 2) {
      Real* const rows[2] = {x + fronts.rows[r] * kNode,
                             r + 1 < end ? x + fronts.rows[r + 1] * kNode : scratch};
      visit(rows);
    }
  };
  for (int s = 0; s < fronts.supernode_count(); ++s) {
    const Real* tile = &tiles_[tile_start_[s]];
    const int pivots = 3 * (fronts.first_pivot[s + 1] - fronts.first_pivot[s]);
    Real* pivot = x + fronts.first_pivot[s] * kNode;
    for (int row = 0; row < pivots; row += kTileRows) {
      Real* at = pivot + row * kBlockWidth;
      Real* const rows[2] = {at, row + 3 < pivots ? at + kNode : scratch};
      TileForward<Real>(tile, row, pivot, rows);
      tile += row * kTileRows;
      WithTileRows(at, pivots - row, [&](Real* t) { SolveTile(tile, t); });
      tile += kTileRows * kTileRows;
    }
    below(s, [&](Real* const rows[2]) {
      TileForward<Real>(tile, pivots, pivot, rows);
      tile += pivots * kTileRows;
    });
  }
  for (int s = fronts.supernode_count() - 1; s >= 0; --s) {
    const int pivots = 3 * (fronts.first_pivot[s + 1] - fronts.first_pivot[s]);
    Real* pivot = x + fronts.first_pivot[s] * kNode;
    const int tiles = TileCount(pivots);
    const Real* tile = &tiles_[tile_start_[s]] + kTileRows * kTileRows * tiles * (tiles + 1) / 2;
    below(s, [&](Real* const rows[2]) {
      TileBackward<Real>(tile, pivots, pivot, rows);
      tile += pivots * kTileRows;
    });
    for (int t = tiles - 1; t >= 0; --t) {
      const int row = t * kTileRows;
      const Real* start = &tiles_[tile_start_[s]] + kTileRows * kTileRows * t * (t + 1) / 2;
      Real* at = pivot + row * kBlockWidth;
      WithTileRows(at, pivots - row,
                   [&](Real* x6) { SolveTileTransposed(start + row * kTileRows, x6); });
      Real* const rows[2] = {at, row + 3 < pivots ? at + kNode : scratch};
      TileBackward<Real>(start, row, pivot, rows);
    }
  }
}

size_t FactorNumbers(const FrontalStructure& fronts) {
  size_t numbers = 0;
  for (int s = 0; s < fronts.supernode_count(); ++s) {
    numbers += PackedSize(fronts.pivot_count(s), fronts.update_count(s));
  }
  return numbers;
}

template class MultifrontalCholesky<double>;
template class MultifrontalCholesky<float>;

}  // namespace carillon::precompute
