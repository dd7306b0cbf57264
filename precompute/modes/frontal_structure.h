// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon::precompute {

/// The supernodes of a Cholesky factorization, by node (each stands for three unknowns).
struct FrontalStructure {
  /// Elimination order: order[i] is the node eliminated i-th. Nested dissection of the node graph.
  std::vector<int32_t> order;
  /// #supernodes + 1: supernode s eliminates nodes first_pivot[s] .. first_pivot[s + 1] - 1.
  std::vector<int32_t> first_pivot;
  /// #supernodes + 1: the front of s has nodes rows[row_start[s] .. row_start[s + 1] - 1], its
  /// pivots first, ascending, numbered in elimination order.
  std::vector<int64_t> row_start;
  std::vector<int32_t> rows;
  /// #supernodes: the supernode that takes the update matrix of s; -1 at a root.
  std::vector<int32_t> parent;
  /// Multiply-adds of the factorization, three unknowns a node.
  double factor_flops = 0;

  int supernode_count() const { return static_cast<int>(parent.size()); }
};

/// Orders the graph of nodes (a third the size of the graph of unknowns, and METIS finds better
/// separators in it) and finds the supernodes, with CHOLMOD's symbolic analysis.
/// Errors: RESOURCE_EXHAUSTED.
absl::StatusOr<FrontalStructure> AnalyzeFronts(const Eigen::SparseMatrix<double>& K);

}  // namespace carillon::precompute
