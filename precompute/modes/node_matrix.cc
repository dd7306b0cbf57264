// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/node_matrix.h"

#include <algorithm>

#include "precompute/modes/block_kernels.h"

namespace carillon::precompute {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Calls visit(row node, column node, row axis, column axis, value) for each entry.
template <typename Visit>
void ForEachEntry(const Sparse& A, const Visit& visit) {
  for (int column = 0; column < A.outerSize(); ++column) {
    for (Sparse::InnerIterator it(A, column); it; ++it) {
      const int row = static_cast<int>(it.row());
      visit(row / 3, column / 3, row % 3, column % 3, it.value());
    }
  }
}

std::vector<int32_t> Inverse(const std::vector<int32_t>& order) {
  std::vector<int32_t> inverse(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    inverse[static_cast<size_t>(order[i])] = static_cast<int32_t>(i);
  }
  return inverse;
}

/// The pattern: one entry a pair of nodes that share a block.
void FillPattern(const Sparse& K, const std::vector<int32_t>& position, NodeMatrix& A) {
  std::vector<std::vector<int32_t>> columns(position.size());
  ForEachEntry(K, [&](int i, int j, int a, int b, double) {
    if (a != 0 || b != 0) return;
    const auto [low, high] =
        std::minmax(position[static_cast<size_t>(i)], position[static_cast<size_t>(j)]);
    columns[static_cast<size_t>(low)].push_back(high);
  });
  A.column_start.push_back(0);
  for (std::vector<int32_t>& column : columns) {
    std::sort(column.begin(), column.end());
    A.row.insert(A.row.end(), column.begin(), column.end());
    A.column_start.push_back(static_cast<int32_t>(A.row.size()));
  }
}

}  // namespace

NodeMatrix MakeNodeMatrix(const Sparse& K, const Sparse& M, const std::vector<int32_t>& order) {
  const std::vector<int32_t> position = Inverse(order);
  NodeMatrix A;
  A.node_count = static_cast<int>(order.size());
  FillPattern(K, position, A);
  A.stiffness.assign(A.row.size() * 9, 0.0);
  A.mass.assign(A.row.size(), 0.0);
  const auto entry = [&](int row, int column) {
    const auto first = A.row.begin() + A.column_start[static_cast<size_t>(column)];
    const auto last = A.row.begin() + A.column_start[static_cast<size_t>(column) + 1];
    return static_cast<size_t>(std::lower_bound(first, last, row) - A.row.begin());
  };
  ForEachEntry(K, [&](int i, int j, int a, int b, double value) {
    const int pi = position[static_cast<size_t>(i)];
    const int pj = position[static_cast<size_t>(j)];
    double* block = &A.stiffness[entry(std::max(pi, pj), std::min(pi, pj)) * 9];
    // A block below the diagonal before the re-ordering may stand above it now.
    if (pi >= pj) block[3 * a + b] = value;
    if (pi <= pj) block[3 * b + a] = value;
  });
  ForEachEntry(M, [&](int i, int j, int a, int b, double value) {
    if (a != 0 || b != 0) return;
    const auto [low, high] =
        std::minmax(position[static_cast<size_t>(i)], position[static_cast<size_t>(j)]);
    A.mass[entry(high, low)] = value;
  });
  return A;
}

void MultiplyStiffness(const NodeMatrix& A, const double* x, double* y) {
  std::fill(y, y + static_cast<ptrdiff_t>(A.node_count) * 3 * kBlockWidth, 0.0);
  for (int j = 0; j < A.node_count; ++j) {
    const int first = A.column_start[j];
    ColumnMultiply(&A.stiffness[static_cast<size_t>(first) * 9], &A.row[first],
                   A.column_start[j + 1] - first, j, x, y);
  }
}

void MultiplyMass(const NodeMatrix& A, const double* x, double* y) {
  std::fill(y, y + static_cast<ptrdiff_t>(A.node_count) * 3 * kBlockWidth, 0.0);
  for (int j = 0; j < A.node_count; ++j) {
    const int first = A.column_start[j];
    ColumnMultiplyScalar(&A.mass[first], &A.row[first], A.column_start[j + 1] - first, j, x, y);
  }
}

}  // namespace carillon::precompute
