// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Refuses a surface that does not bound one solid body; on such a surface the mesher would crash
/// or make a wrong mesh. CheckSurface repairs nothing, because contacts refer to the triangles as
/// given. A surface that is inside out as a whole is accepted with a warning.
///
/// Returns warnings for the user about an accepted surface. Errors: MESH_EMPTY, MESH_TOO_LARGE,
/// MESH_INDEX_OUT_OF_RANGE, MESH_NOT_FINITE, MESH_DEGENERATE_TRIANGLE, MESH_DUPLICATE_SHELL,
/// MESH_NOT_MANIFOLD, MESH_NOT_CLOSED, MESH_NOT_ORIENTED, MESH_ZERO_VOLUME, MESH_SELF_INTERSECTING,
/// MESH_SEVERAL_PIECES.
absl::StatusOr<std::vector<std::string>> CheckSurface(const SurfaceMesh& surface);

}  // namespace carillon::precompute
