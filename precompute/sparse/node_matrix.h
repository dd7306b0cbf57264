// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// Number of vectors in a block of the solver: two AVX-512 registers of doubles for each row.
inline constexpr int kBlockWidth = 16;

/// A matrix m (x) I3, stored by rows with both triangles.
template <typename Real>
struct MassRows {
  std::vector<int32_t> start;  ///< #nodes + 1
  std::vector<int32_t> column;
  std::vector<Real> value;
};

/// D^-1/2 K D^-1/2 and D^-1/2 M D^-1/2, with D the diagonal of M, in elimination order: the lower
/// triangles in 3x3 blocks by node. Unknowns are y = D^1/2 x. The mass matrix is m (x) I3, because
/// the mass of an element does not couple directions; a lumped one becomes the identity, and the
/// eigenproblem a standard one.
struct NodeMatrix {
  int node_count = 0;
  std::vector<int32_t> column_start;  ///< #nodes + 1
  std::vector<int32_t> row;           ///< ascending in each column, the diagonal first
  std::vector<double> stiffness;      ///< 9 an entry, row-major
  std::vector<double> mass;           ///< 1 an entry
  std::vector<double> root_mass;      ///< #nodes: the diagonal of D^1/2
  bool mass_is_identity = false;
};

/// The inverse permutation: the position of each node in `order`.
std::vector<int32_t> Inverse(const std::vector<int32_t>& order);

/// Re-orders K and M (3n by 3n, lower triangles) to `order`: node order[i] becomes i.
NodeMatrix MakeNodeMatrix(const Eigen::SparseMatrix<double>& K,
                          const Eigen::SparseMatrix<double>& M, const std::vector<int32_t>& order);

/// y = K x; x and y: 3 #nodes by kBlockWidth, row-major, in elimination order.
template <typename Real>
void MultiplyStiffness(const NodeMatrix& A, const Real* x, double* y);

/// Empty where the mass matrix is the identity.
template <typename Real>
MassRows<Real> MakeMassRows(const NodeMatrix& A);

/// y = M x, not for the identity; x and y as above.
template <typename Real>
void MultiplyMass(const MassRows<Real>& M, Workers& workers, const Real* x, Real* y);

}  // namespace carillon::precompute
