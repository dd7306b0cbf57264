// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/node_matrix.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "precompute/sparse/block_kernels.h"

namespace carillon::precompute {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// Calls visit(row node, column node, row axis, column axis, value) for each entry.
template <typename Visit>
void ForEachEntry(const Sparse& A, Visit visit) {
  for (int column = 0; column < A.outerSize(); ++column) {
    for (Sparse::InnerIterator it(A, column); it; ++it) {
      const int row = static_cast<int>(it.row());
      visit(row / 3, column / 3, row % 3, column % 3, it.value());
    }
  }
}

/// The pattern: one entry a pair of nodes that share a block.
void FillPattern(const Sparse& K, const std::vector<int32_t>& position, NodeMatrix& A) {
  const auto for_each = [&](const auto& visit) {
    for (int column = 0; column < K.outerSize(); column += 3) {
      for (Sparse::InnerIterator it(K, column); it; ++it) {
        if (it.row() % 3 != 0) continue;
        visit(std::minmax(position[static_cast<size_t>(it.row()) / 3],
                          position[static_cast<size_t>(column) / 3]));
      }
    }
  };
  A.column_start.assign(position.size() + 1, 0);
  for_each([&](const auto& pair) { ++A.column_start[static_cast<size_t>(pair.first) + 1]; });
  std::partial_sum(A.column_start.begin(), A.column_start.end(), A.column_start.begin());
  A.row.resize(static_cast<size_t>(A.column_start.back()));
  std::vector<int32_t> next(A.column_start.begin(), A.column_start.end() - 1);
  for_each([&](const auto& pair) {
    A.row[static_cast<size_t>(next[static_cast<size_t>(pair.first)]++)] = pair.second;
  });
  for (size_t j = 0; j < position.size(); ++j) {
    std::sort(A.row.begin() + A.column_start[j], A.row.begin() + A.column_start[j + 1]);
  }
}

/// K := D^-1/2 K D^-1/2 and the same for M.
void ScaleByMass(NodeMatrix& A) {
  A.root_mass.resize(static_cast<size_t>(A.node_count));
  for (size_t j = 0; j < A.root_mass.size(); ++j) {
    A.root_mass[j] = std::sqrt(A.mass[static_cast<size_t>(A.column_start[j])]);
  }
  A.mass_is_identity = true;
  for (size_t j = 0; j < A.root_mass.size(); ++j) {
    for (auto e = static_cast<size_t>(A.column_start[j]);
         e < static_cast<size_t>(A.column_start[j + 1]); ++e) {
      const auto i = static_cast<size_t>(A.row[e]);
      const double scale = 1 / (A.root_mass[i] * A.root_mass[j]);
      for (size_t k = 9 * e; k < 9 * e + 9; ++k) A.stiffness[k] *= scale;
      A.mass[e] = i == j ? 1 : A.mass[e] * scale;
      if (i != j && A.mass[e] != 0) A.mass_is_identity = false;
    }
  }
}

}  // namespace

std::vector<int32_t> Inverse(const std::vector<int32_t>& order) {
  std::vector<int32_t> inverse(order.size());
  for (size_t i = 0; i < order.size(); ++i) {
    inverse[static_cast<size_t>(order[i])] = static_cast<int32_t>(i);
  }
  return inverse;
}

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
  double* block = nullptr;
  ForEachEntry(K, [&, row = -1, pi = 0, pj = 0](int i, int j, int a, int b, double value) mutable {
    if (i != row || i == j) {  // the three of a column follow one another
      row = i;
      pi = position[static_cast<size_t>(i)];
      pj = position[static_cast<size_t>(j)];
      block = &A.stiffness[entry(std::max(pi, pj), std::min(pi, pj)) * 9];
    }
    // Reordering may move a block from below the diagonal to above it.
    if (pi >= pj) block[3 * a + b] = value;
    if (pi <= pj) block[3 * b + a] = value;
  });
  ForEachEntry(M, [&](int i, int j, int a, int b, double value) {
    if (a != 0 || b != 0) return;
    const auto [low, high] =
        std::minmax(position[static_cast<size_t>(i)], position[static_cast<size_t>(j)]);
    A.mass[entry(high, low)] = value;
  });
  ScaleByMass(A);
  return A;
}

template <typename Real>
void MultiplyStiffness(const NodeMatrix& A, const Real* x, double* y) {
  std::fill(y, y + static_cast<ptrdiff_t>(A.node_count) * 3 * kBlockWidth, 0.0);
  for (int j = 0; j < A.node_count; ++j) {
    const int first = A.column_start[j];
    ColumnMultiply(&A.stiffness[static_cast<size_t>(first) * 9], &A.row[first],
                   A.column_start[j + 1] - first, j, x, y);
  }
}

template <typename Real>
MassRows<Real> MakeMassRows(const NodeMatrix& A) {
  MassRows<Real> M;
  if (A.mass_is_identity) return M;
  const auto n = static_cast<size_t>(A.node_count);
  const auto for_each = [&](const auto& visit) {
    for (size_t j = 0; j < n; ++j) {
      for (int e = A.column_start[j]; e < A.column_start[j + 1]; ++e) {
        const auto entry = static_cast<size_t>(e);
        visit(A.row[entry], static_cast<int32_t>(j), A.mass[entry]);
        if (A.row[entry] != static_cast<int32_t>(j)) {
          visit(static_cast<int32_t>(j), A.row[entry], A.mass[entry]);
        }
      }
    }
  };
  M.start.assign(n + 1, 0);
  for_each([&](int32_t i, int32_t, double) { ++M.start[static_cast<size_t>(i) + 1]; });
  std::partial_sum(M.start.begin(), M.start.end(), M.start.begin());
  M.column.resize(static_cast<size_t>(M.start[n]));
  M.value.resize(M.column.size());
  std::vector<int32_t> next(M.start.begin(), M.start.end() - 1);
  for_each([&](int32_t i, int32_t j, double value) {
    const auto at = static_cast<size_t>(next[static_cast<size_t>(i)]++);
    M.column[at] = j;
    M.value[at] = static_cast<Real>(value);
  });
  return M;
}

template <typename Real>
void MultiplyMass(const MassRows<Real>& M, Workers& workers, const Real* x, Real* y) {
  constexpr ptrdiff_t kNode = 3 * kBlockWidth;
  constexpr int64_t kRowsTogether = 64;
  workers.ForParts(static_cast<int64_t>(M.start.size()) - 1, kRowsTogether,
                   [&](int64_t begin, int64_t end, int) {
                     for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
                       const auto first = static_cast<size_t>(M.start[i]);
                       RowMultiply(&M.value[first], &M.column[first], M.start[i + 1] - M.start[i],
                                   x, y + static_cast<ptrdiff_t>(i) * kNode);
                     }
                   });
}

template void MultiplyStiffness(const NodeMatrix&, const float*, double*);
template void MultiplyStiffness(const NodeMatrix&, const double*, double*);
template MassRows<float> MakeMassRows(const NodeMatrix&);
template MassRows<double> MakeMassRows(const NodeMatrix&);
template void MultiplyMass(const MassRows<float>&, Workers&, const float*, float*);
template void MultiplyMass(const MassRows<double>&, Workers&, const double*, double*);

}  // namespace carillon::precompute
