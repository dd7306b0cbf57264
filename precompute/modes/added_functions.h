// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace carillon::precompute {

/// A function on the tetrahedron, at a point: its value, and its derivatives with respect to the
/// four barycentric coordinates.
struct FunctionAt {
  double value;
  Eigen::Vector4d derivative;
};

/// The element's own shape functions, in the order of TetMesh.
std::vector<FunctionAt> BaseFunctions(const Eigen::Vector4d& barycentric, int node_count);

/// The functions that the next order adds: for linear elements 4 L_a L_b on each edge; for
/// quadratic ones L_a L_b (L_a - L_b) on each edge, L_a L_b L_c on each face. Edges and faces are
/// in the order of kTetEdges and kTetFaces.
std::vector<FunctionAt> AddedFunctions(const Eigen::Vector4d& barycentric, int node_count);

}  // namespace carillon::precompute
