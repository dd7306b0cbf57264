// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Fills `mesh.boundary` with the faces that belong to one element only, oriented outward, in the
/// order of the elements. The given triangle of face i is i, because BoundarySurface(mesh) becomes
/// the given surface.
/// Errors: MESH_NOT_MANIFOLD (three elements or more share a face).
absl::Status FindBoundary(TetMesh& mesh);

/// Returns these triangles with the vertices that they have, in the order of their first use.
SurfaceMesh PartOf(const std::vector<Point>& vertices,
                   std::vector<std::array<int32_t, 3>> triangles);

/// Returns the boundary as a surface, whose triangle i has the corners of boundary face i. For a
/// mesh read from a file, this surface is the given one.
SurfaceMesh BoundarySurface(const TetMesh& mesh);

}  // namespace carillon::precompute
