// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The Kronecker product m (x) I3 of a matrix m of nodes by nodes and the 3 by 3 identity. m is
/// stored by rows with both triangles.
template <typename Real>
struct MassRows {
  std::vector<int32_t> start;  ///< #nodes + 1
  std::vector<int32_t> column;
  std::vector<Real> value;
};

/// The matrices D^-1/2 K D^-1/2 and D^-1/2 M D^-1/2 in elimination order, where D is the diagonal
/// of M. The lower triangles are stored in 3x3 blocks by node. Unknowns are y = D^1/2 x. The mass
/// matrix is m (x) I3, because the mass of an element does not couple directions. A lumped mass
/// matrix becomes the identity, and the eigenproblem becomes a standard one.
struct NodeMatrix {
  int node_count = 0;
  std::vector<int32_t> column_start;  ///< #nodes + 1
  std::vector<int32_t> row;           ///< ascending in each column, the diagonal first
  std::vector<double> stiffness;      ///< 9 numbers for each entry, row-major
  std::vector<double> mass;           ///< 1 number for each entry
  std::vector<double> root_mass;      ///< #nodes: the diagonal of D^1/2
  bool mass_is_identity = false;
};

/// Returns the inverse permutation, that is, the position of each node in `order`.
std::vector<int32_t> Inverse(const std::vector<int32_t>& order);

/// Re-orders K and M (3n by 3n, lower triangles) to `order`: node order[i] becomes i.
NodeMatrix MakeNodeMatrix(const Eigen::SparseMatrix<double>& K,
                          const Eigen::SparseMatrix<double>& M, const std::vector<int32_t>& order);

/// Computes y = K x. x and y are 3 #nodes by kBlockWidth, row-major, in elimination order.
template <typename Real>
void MultiplyStiffness(const NodeMatrix& A, const Real* x, double* y);

/// Returns the rows of the mass matrix. The result is empty if the mass matrix is the identity.
template <typename Real>
MassRows<Real> MakeMassRows(const NodeMatrix& A);

/// Computes y = M x. M must not be the identity. x and y are laid out as in MultiplyStiffness.
template <typename Real>
void MultiplyMass(const MassRows<Real>& M, Workers& workers, const Real* x, Real* y);

}  // namespace carillon::precompute
