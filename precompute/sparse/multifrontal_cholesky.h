// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/sparse/front_walk.h"
#include "precompute/sparse/frontal_structure.h"
#include "precompute/sparse/node_matrix.h"

namespace carillon::precompute {

/// The factorization L L^T = K - shift M by the multifrontal method (Duff and Reid 1983), for
/// solves of kBlockWidth right-hand sides at once. The panel of each front, its triangle of pivots
/// with the rows of updates below, is packed in tiles of kTileRows rows, which are two nodes, in
/// the order in which a solve reads them:
///
///     rows
///     0- 5   [D0]                     D: a diagonal block, its diagonal inverted
///     6-11   [T1 |D1]                 T: the columns left of it
///     12-17  [T2     |D2]
///     18-23  [T3         ]            rows of updates: all pivot columns
///
///     memory: D0 | T1 D1 | T2 D2 | T3     each tile: column 0 (kTileRows numbers), column 1, ...
///
/// A last tile with one node is filled up with zeros. docs/solver.md tells why.
template <typename Real>
class MultifrontalCholesky {
 public:
  /// Errors: VERIFICATION_FAILED if K - shift M is not positive definite.
  static absl::StatusOr<MultifrontalCholesky> Factorize(const FrontalStructure& fronts,
                                                        const NodeMatrix& A, double shift,
                                                        Workers& workers, const PartDone& progress);

  /// Overwrites the right-hand sides x by the solutions. x is 3 #nodes by kBlockWidth, row-major,
  /// in elimination order.
  void Solve(Real* x, Workers& workers) const;

  /// Solves for kWideBlock right-hand sides with one thread.
  void SolveWide(Real* x) const requires std::is_same_v<Real, float>;

  size_t stored_bytes() const { return tile_start_.back() * sizeof(Real); }

 private:
  template <int kWidth>
  class Substitution;

  const FrontalStructure* fronts_ = nullptr;
  std::unique_ptr<Real[]> tiles_;   // not zeroed, because the factorization writes every number
  std::vector<size_t> tile_start_;  ///< #supernodes + 1, into tiles_
  std::vector<int32_t> top_nodes_;  ///< the nodes eliminated by the fronts above all subtrees
  std::vector<int32_t> top_index_;  ///< #nodes: index of each node in top_nodes_, or -1
};

/// Returns the number of matrix entries that a factor stores.
size_t FactorNumbers(const FrontalStructure& fronts);

}  // namespace carillon::precompute
