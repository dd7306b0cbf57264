// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace carillon::precompute {

/// The value of a function on the tetrahedron at a point, and its derivatives with respect to the
/// four barycentric coordinates.
struct FunctionAt {
  double value;
  Eigen::Vector4d derivative;
};

/// Returns the element's own shape functions, in the order of TetMesh.
std::vector<FunctionAt> BaseFunctions(const Eigen::Vector4d& barycentric, int node_count);

/// Returns the functions that elements of the next order add. For linear elements these are 4 L_a
/// L_b on each edge. For quadratic elements they are L_a L_b (L_a - L_b) on each edge and L_a L_b
/// L_c on each face. Edges and faces are in the order of kTetEdges and kTetFaces.
std::vector<FunctionAt> AddedFunctions(const Eigen::Vector4d& barycentric, int node_count);

}  // namespace carillon::precompute
