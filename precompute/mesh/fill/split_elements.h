// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns a mesh of ten-node tetrahedra in which each tetrahedron of `mesh`, which has ten nodes
/// and straight edges, is divided into eight of half the size. The displacements that `mesh` can
/// represent are among those of the result, so that each of its frequencies is at most that of
/// `mesh`. An edge between two fixed nodes is fixed.
TetMesh SplitElements(const TetMesh& mesh);

}  // namespace carillon::precompute
