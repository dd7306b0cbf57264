// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns the nodes of a mesh that are not fixed, in ascending order, which is the order of the
/// unknowns.
std::vector<int32_t> MovingNodes(const TetMesh& mesh);

/// Returns the positions of `nodes`, metres.
std::vector<Point> PlacesOf(const std::vector<int32_t>& nodes, const TetMesh& mesh);

/// Restricts matrices of all nodes to the rows and columns of the moving nodes.
SystemMatrices Restricted(const SystemMatrices& system, const std::vector<int32_t>& moving);

/// Extends vectors (columns) of the moving nodes to all `node_count` nodes, with zeros at fixed
/// nodes.
Eigen::MatrixXd Extended(const Eigen::MatrixXd& vectors, const std::vector<int32_t>& moving,
                         size_t node_count);

}  // namespace carillon::precompute
