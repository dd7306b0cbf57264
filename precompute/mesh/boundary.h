// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Fills `mesh.boundary` with the faces that belong to one element only, oriented outward, in the
/// order of the elements; face i lies on given triangle i, that is BoundarySurface(mesh).
/// Errors: MESH_NOT_MANIFOLD (a face of three elements or more).
absl::Status FindBoundary(TetMesh& mesh);

/// The boundary as a surface: triangle i has the corners of boundary face i. For a mesh read from a
/// file it is the surface as given.
SurfaceMesh BoundarySurface(const TetMesh& mesh);

}  // namespace carillon::precompute
