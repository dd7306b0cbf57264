// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The nodes of a mesh that are not held, ascending: the order of the unknowns.
std::vector<int32_t> MovingNodes(const TetMesh& mesh);

/// The places of some nodes, metres.
std::vector<Point> PlacesOf(const std::vector<int32_t>& nodes, const TetMesh& mesh);

/// The rows and columns of the moving nodes, of matrices of all nodes.
SystemMatrices Restricted(const SystemMatrices& system, const std::vector<int32_t>& moving);

/// Vectors of moving nodes (columns) as those of all `node_count` nodes: zero where they are held.
Eigen::MatrixXd Extended(const Eigen::MatrixXd& vectors, const std::vector<int32_t>& moving,
                         size_t node_count);

}  // namespace carillon::precompute
