// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

namespace carillon::precompute {

/// Vectors that the block solver handles at once: two AVX-512 registers of doubles a row.
inline constexpr int kBlockWidth = 16;

/// The lower triangle of K and M in 3x3 blocks by node, in elimination order. M is m (x) I3,
/// because the mass of an element does not couple directions.
struct NodeMatrix {
  int node_count = 0;
  std::vector<int32_t> column_start;  ///< #nodes + 1
  std::vector<int32_t> row;           ///< ascending in each column, the diagonal first
  std::vector<double> stiffness;      ///< 9 an entry, row-major
  std::vector<double> mass;           ///< 1 an entry
};

/// Re-orders K and M (3n by 3n, lower triangles) to `order`: node order[i] becomes i.
NodeMatrix MakeNodeMatrix(const Eigen::SparseMatrix<double>& K,
                          const Eigen::SparseMatrix<double>& M, const std::vector<int32_t>& order);

/// y = K x and y = M x; x and y: 3 #nodes by kBlockWidth, row-major, in elimination order.
void MultiplyStiffness(const NodeMatrix& A, const double* x, double* y);
void MultiplyMass(const NodeMatrix& A, const double* x, double* y);

}  // namespace carillon::precompute
