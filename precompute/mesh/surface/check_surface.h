// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Refuses a surface that does not bound one solid body, which the mesher would crash on or fill
/// wrongly. Nothing is repaired: triangles and their vertices stay as given, because contacts name
/// them. A surface that is inside out as a whole is accepted with a warning.
///
/// Result: what the user should know though the surface is accepted.
/// Errors: MESH_EMPTY, MESH_TOO_LARGE, MESH_INDEX_OUT_OF_RANGE, MESH_NOT_FINITE,
/// MESH_DEGENERATE_TRIANGLE, MESH_DUPLICATE_SHELL, MESH_NOT_MANIFOLD, MESH_NOT_CLOSED,
/// MESH_NOT_ORIENTED, MESH_ZERO_VOLUME, MESH_SELF_INTERSECTING, MESH_SEVERAL_PIECES.
absl::StatusOr<std::vector<std::string>> CheckSurface(const SurfaceMesh& surface);

}  // namespace carillon::precompute
