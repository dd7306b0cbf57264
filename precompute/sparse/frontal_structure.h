// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon::precompute {

/// The supernodes begin ... end - 1, of which the last one is the root.
struct Subtree {
  int begin = 0;
  int end = 0;
  /// Largest count of numbers that the update matrices of these supernodes take at one time.
  size_t stack_size = 0;
};

/// The supernodes of a Cholesky factorization, in terms of nodes; each node has three unknowns.
struct FrontalStructure {
  /// Elimination order: order[i] is the node eliminated i-th. It is a nested dissection of the
  /// graph of nodes.
  std::vector<int32_t> order;
  /// #supernodes + 1: supernode s eliminates nodes first_pivot[s] .. first_pivot[s + 1] - 1.
  std::vector<int32_t> first_pivot;
  /// #supernodes + 1: the front of s has nodes rows[row_start[s] .. row_start[s + 1] - 1], its
  /// pivots first, ascending, numbered in elimination order.
  std::vector<int64_t> row_start;
  std::vector<int32_t> rows;
  /// #supernodes: the supernode to whose front the update matrix of s is added; -1 at a root.
  /// Supernodes are in postorder: a subtree is contiguous, and the children of s are the roots of
  /// the subtrees that end before s.
  std::vector<int32_t> parent;
  /// #supernodes + 1: the children of s are child[child_start[s] .. child_start[s + 1] - 1],
  /// ascending.
  std::vector<int32_t> child_start;
  std::vector<int32_t> child;
  /// #supernodes: the number of multiply-adds of each supernode. factor_flops is their sum.
  std::vector<double> flops;
  double factor_flops = 0;
  /// Subtrees with little work each, which single threads process, and the supernodes above all
  /// subtrees, ascending.
  std::vector<Subtree> subtrees;
  std::vector<int32_t> top;

  int node_count() const { return static_cast<int>(order.size()); }
  int supernode_count() const { return static_cast<int>(parent.size()); }
  std::span<const int32_t> children(int s) const {
    return std::span(child).subspan(static_cast<size_t>(child_start[static_cast<size_t>(s)]),
                                    static_cast<size_t>(child_start[static_cast<size_t>(s) + 1] -
                                                        child_start[static_cast<size_t>(s)]));
  }
  int pivot_count(int s) const {
    return 3 * (first_pivot[static_cast<size_t>(s) + 1] - first_pivot[static_cast<size_t>(s)]);
  }
  int height(int s) const {
    return 3 * static_cast<int>(row_start[static_cast<size_t>(s) + 1] -
                                row_start[static_cast<size_t>(s)]);
  }
  int update_count(int s) const { return height(s) - pivot_count(s); }
};

/// Orders the graph of nodes and finds the supernodes with CHOLMOD's symbolic analysis. The graph
/// of nodes is used because it has a third of the size of the graph of unknowns, and because METIS
/// finds better separators in it. Errors: OUT_OF_MEMORY.
absl::StatusOr<FrontalStructure> AnalyzeFronts(const Eigen::SparseMatrix<double>& K);

}  // namespace carillon::precompute
