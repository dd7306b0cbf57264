// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/multifrontal_cholesky.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <vector>

#include "precompute/sparse/front_elimination.h"
#include "precompute/sparse/tile_kernels.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

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
  factor.tiles_.reset(new Real[factor.tile_start_.back()]);
  factor.top_index_.assign(fronts.order.size(), -1);
  for (const int top : fronts.top) {
    for (int node = fronts.first_pivot[top]; node < fronts.first_pivot[top + 1]; ++node) {
      factor.top_index_[node] = static_cast<int32_t>(factor.top_nodes_.size());
      factor.top_nodes_.push_back(node);
    }
  }
  const auto eliminate = [&](int s, Front<Real>& front, Workers& sharing) {
    const Elimination result = Eliminate(front, Real{0}, sharing, nullptr);
    if (result != Elimination::kDone) return NotPositiveDefinite();
    PackPanel(front, &factor.tiles_[factor.tile_start_[s]]);
    return absl::OkStatus();
  };
  FrontWalk<Real, decltype(eliminate)> walk(fronts, A, shift, eliminate, workers);
  RETURN_IF_ERROR(walk.Run(progress));
  return factor;
}

namespace {

/// A diagonal tile may be half full. Its rows are copied to a full tile and back; absent rows are
/// zero.
template <int kWidth, typename Real, typename Solve>
void WithTileRows(Real* x, int rows, const Solve& solve) {
  if (rows >= kTileRows) {
    solve(x);
    return;
  }
  std::array<Real, kTileRows * kWidth> copy{};
  std::copy(x, x + rows * kWidth, copy.begin());
  solve(copy.data());
  std::copy(copy.begin(), copy.begin() + rows * kWidth, x);
}

/// Number of tiles whose triangle one thread solves while the others wait.
constexpr int kGroup = 32;

/// Smallest size of a front, in numbers, for which waking other threads is worthwhile.
constexpr size_t kShared = 200'000;

}  // namespace

/// One solution: the panels of the factor with the rows of x that they act on.
template <typename Real>
template <int kWidth>
class MultifrontalCholesky<Real>::Substitution {
 public:
  /// Numbers of a node in a block of vectors.
  static constexpr ptrdiff_t kNode = 3 * kWidth;

  Substitution(const MultifrontalCholesky& factor, Real* x)
      : factor_(factor), fronts_(*factor.fronts_), x_(x) {}

  /// Gives a thread the rows of nodes. Rows of nodes from `end` on, which belong to the top, are in
  /// `above`, because several subtrees add to them. `scratch` stands for the missing second node of
  /// a tile.
  struct Rows {
    int end = 0;
    Real* above = nullptr;
    std::array<Real, static_cast<size_t>(kNode)> scratch{};
  };

  /// All fronts, one after another.
  void Run(Workers& workers) const {
    Rows rows{.end = fronts_.node_count(), .above = nullptr, .scratch = {}};
    for (int s = 0; s < fronts_.supernode_count(); ++s) Forward(s, rows, workers);
    for (int s = fronts_.supernode_count(); s-- > 0;) Backward(s, workers);
  }

  /// Solves L y = x in the rows of front s. The triangle is solved in groups of tiles: a group
  /// first subtracts the product with the columns solved before it, which threads share, and then
  /// solves its own triangle, tile after tile.
  void Forward(int s, Rows& rows, Workers& workers) const {
    const int pivots = fronts_.pivot_count(s);
    Real* pivot = At(fronts_.first_pivot[s]);
    const int tiles = TileCount(pivots);
    for (int first_tile = 0; first_tile < tiles; first_tile += kGroup) {
      const int end_tile = std::min(tiles, first_tile + kGroup);
      const int solved_columns = first_tile * kTileRows;
      Share(workers, solved_columns * (end_tile - first_tile), end_tile - first_tile,
            [&](int begin, int end) {
              std::array<Real, static_cast<size_t>(kNode)> scratch{};
              for (int t = first_tile + begin; t < first_tile + end; ++t) {
                Real* const nodes[2] = {PivotRow(pivot, t),
                                        SecondPivotRow(pivot, t, pivots, scratch.data())};
                TileForward<Real, kWidth>(Triangle(s, t), solved_columns, pivot, nodes);
              }
            });
      for (int t = first_tile; t < end_tile; ++t) {
        const int row = t * kTileRows;
        const Real* tile = Triangle(s, t) + solved_columns * kTileRows;
        Real* const nodes[2] = {PivotRow(pivot, t),
                                SecondPivotRow(pivot, t, pivots, rows.scratch.data())};
        TileForward<Real, kWidth>(tile, row - solved_columns, pivot + solved_columns * kWidth,
                                  nodes);
        WithTileRows<kWidth>(nodes[0], pivots - row, [&](Real* x6) {
          TileSolve<Real, kWidth>(tile + (row - solved_columns) * kTileRows, x6);
        });
      }
    }
    const int below = BelowCount(s);
    Share(workers, pivots, below, [&](int begin, int end) {
      std::array<Real, static_cast<size_t>(kNode)> scratch{};
      for (int t = begin; t < end; ++t) {
        Real* nodes[2];
        BelowRows(s, t, rows, scratch.data(), nodes);
        TileForward<Real, kWidth>(Below(s, t), pivots, pivot, nodes);
      }
    });
  }

  /// Solves L^T y = x in the pivots of front s, in the reverse order. Threads take different
  /// columns, because all tiles add to all columns.
  void Backward(int s, Workers& workers) const {
    const int pivots = fronts_.pivot_count(s);
    Real* pivot = At(fronts_.first_pivot[s]);
    const int tiles = TileCount(pivots);
    std::array<Real, static_cast<size_t>(kNode)> zero{};
    Rows rows{.end = fronts_.node_count(), .above = nullptr, .scratch = {}};
    Share(workers, BelowCount(s) * kTileRows, pivots, [&](int begin, int end) {
      for (int t = 0; t < BelowCount(s); ++t) {
        Real* nodes[2];
        BelowRows(s, t, rows, zero.data(), nodes);
        TileBackward<Real, kWidth>(Below(s, t) + begin * kTileRows, end - begin,
                                   pivot + begin * kWidth, nodes);
      }
    });
    for (int first_tile = (tiles - 1) / kGroup * kGroup; first_tile >= 0; first_tile -= kGroup) {
      const int end_tile = std::min(tiles, first_tile + kGroup);
      const int columns_left = first_tile * kTileRows;
      for (int t = end_tile - 1; t >= first_tile; --t) {
        const int row = t * kTileRows;
        const Real* tile = Triangle(s, t);
        Real* const nodes[2] = {PivotRow(pivot, t), SecondPivotRow(pivot, t, pivots, zero.data())};
        WithTileRows<kWidth>(nodes[0], pivots - row, [&](Real* x6) {
          TileSolveTransposed<Real, kWidth>(tile + row * kTileRows, x6);
        });
        TileBackward<Real, kWidth>(tile + columns_left * kTileRows, row - columns_left,
                                   pivot + columns_left * kWidth, nodes);
      }
      Share(workers, (end_tile - first_tile) * kTileRows, columns_left, [&](int begin, int end) {
        for (int t = first_tile; t < end_tile; ++t) {
          Real* const nodes[2] = {PivotRow(pivot, t),
                                  SecondPivotRow(pivot, t, pivots, zero.data())};
          TileBackward<Real, kWidth>(Triangle(s, t) + begin * kTileRows, end - begin,
                                     pivot + begin * kWidth, nodes);
        }
      });
    }
  }

 private:
  Real* At(int node) const { return x_ + node * kNode; }
  static Real* PivotRow(Real* pivot, int tile) { return pivot + tile * kTileRows * kWidth; }
  static Real* SecondPivotRow(Real* pivot, int tile, int pivots, Real* scratch) {
    return tile * kTileRows + 3 < pivots ? PivotRow(pivot, tile) + kNode : scratch;
  }

  const Real* Triangle(int s, int tile) const {
    return &factor_.tiles_[factor_.tile_start_[s]] +
           static_cast<ptrdiff_t>(kTileRows) * kTileRows * tile * (tile + 1) / 2;
  }
  const Real* Below(int s, int tile) const {
    const int pivots = fronts_.pivot_count(s);
    return Triangle(s, TileCount(pivots)) + static_cast<ptrdiff_t>(tile) * pivots * kTileRows;
  }
  int BelowCount(int s) const { return TileCount(fronts_.update_count(s)); }

  /// Sets `nodes` to the rows of the two nodes of a tile below the triangle.
  void BelowRows(int s, int tile, Rows& rows, Real* scratch, Real** nodes) const {
    const int64_t first = fronts_.row_start[s] + fronts_.pivot_count(s) / 3 + 2 * tile;
    const auto find = [&](int node) {
      return node < rows.end ? At(node) : rows.above + factor_.top_index_[node] * kNode;
    };
    nodes[0] = find(fronts_.rows[first]);
    nodes[1] = first + 1 < fronts_.row_start[s + 1] ? find(fronts_.rows[first + 1]) : scratch;
  }

  /// Calls visit(begin, end) for parts of 0 ... n - 1, each of `work` numbers an item.
  template <typename Visit>
  static void Share(Workers& workers, int work, int n, const Visit& visit) {
    if (workers.count() == 1 || static_cast<size_t>(work) * static_cast<size_t>(n) < kShared) {
      if (n > 0) visit(0, n);
      return;
    }
    workers.ForParts(n, 1, [&](int64_t begin, int64_t end, int) {
      visit(static_cast<int>(begin), static_cast<int>(end));
    });
  }

  const MultifrontalCholesky& factor_;
  const FrontalStructure& fronts_;
  Real* x_;
};

template <typename Real>
void MultifrontalCholesky<Real>::Solve(Real* x, Workers& workers) const {
  const FrontalStructure& fronts = *fronts_;
  using Narrow = Substitution<kBlockWidth>;
  constexpr ptrdiff_t kNode = Narrow::kNode;
  const Narrow substitution(*this, x);
  if (workers.count() == 1) {
    substitution.Run(workers);
    return;
  }
  const size_t above_size = top_nodes_.size() * static_cast<size_t>(kNode);
  std::vector<std::vector<Real>> above(static_cast<size_t>(workers.count()));
  std::atomic<size_t> next = 0;
  workers.Run([&](int t) {
    Workers alone(1);
    std::vector<Real>& mine = above[static_cast<size_t>(t)];
    mine.assign(above_size, Real{0});
    for (size_t i = next++; i < fronts.subtrees.size(); i = next++) {
      const Subtree& subtree = fronts.subtrees[i];
      typename Narrow::Rows rows{
          .end = fronts.first_pivot[subtree.end], .above = mine.data(), .scratch = {}};
      for (int s = subtree.begin; s < subtree.end; ++s) substitution.Forward(s, rows, alone);
    }
  });
  for (const std::vector<Real>& part : above) {
    for (size_t k = 0; k < top_nodes_.size(); ++k) {
      Real* to = x + top_nodes_[k] * kNode;
      const Real* from = &part[k * static_cast<size_t>(kNode)];
      for (ptrdiff_t c = 0; c < kNode; ++c) to[c] += from[c];
    }
  }
  typename Narrow::Rows rows{.end = fronts.node_count(), .above = nullptr, .scratch = {}};
  for (const int s : fronts.top) substitution.Forward(s, rows, workers);
  for (size_t k = fronts.top.size(); k-- > 0;) substitution.Backward(fronts.top[k], workers);
  workers.ForEach(static_cast<int64_t>(fronts.subtrees.size()), [&](int64_t i) {
    Workers alone(1);
    const Subtree& subtree = fronts.subtrees[static_cast<size_t>(i)];
    for (int s = subtree.end; s-- > subtree.begin;) substitution.Backward(s, alone);
  });
}

template <typename Real>
void MultifrontalCholesky<Real>::SolveWide(Real* x) const requires std::is_same_v<Real, float> {
  Workers alone(1);
  Substitution<kWideBlock>(*this, x).Run(alone);
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
