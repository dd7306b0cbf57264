// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/mesh/size_field.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The uniform refinement that a graded mesh replaces.
struct UniformRefinement {
  double element_size_m;       ///< of the last mesh's surface, as SurfaceElementSize() measures it
  double next_element_size_m;  ///< of the mesh to make
  double dimension;            ///< 2 for walls, 3 for solids: power of the number of nodes
  double node_growth;          ///< predicted number of its nodes, relative to the last mesh
};

/// Returns element sizes, relative to `next_element_size_m`, with which a mesh has the error of the
/// uniform refinement and as few nodes as possible.
///
/// `error_at_node` has the shares of the error in the last mesh (ErrorEstimate::at_node). If the
/// elements near node i become x_i times as large, the shares are taken to become x_i^q times as
/// large. Then the number of nodes, sum_i x_i^-d, is smallest for the same error if x_i is
/// proportional to error_i^(-1 / (q + d)) (Zienkiewicz and Zhu, A simple error estimator and
/// adaptive procedure, Int. J. Numer. Methods Eng. 24, 1987). The factors x_i are limited, and
/// neighbouring sizes differ by at most a part of their distance. Where such a mesh would save less
/// than a quarter of the nodes, the field is uniform.
SizeField GradedSize(const TetMesh& mesh, const std::vector<double>& error_at_node,
                     const UniformRefinement& uniform);

}  // namespace carillon::precompute
