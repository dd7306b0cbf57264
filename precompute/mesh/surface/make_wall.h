// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Hollows out a closed surface that CheckSurface accepted: adds the surface at depth `wall_m`
/// inside, an isosurface of the signed distance, as the wall of a cavity. The given surface stays
/// as it is.
///
/// Errors: MESH_WALL_IMPOSSIBLE: the body is nowhere thicker than twice the wall, or the wall is
/// too thin beside the body.
absl::StatusOr<RepairedSurface> HollowOut(const SurfaceMesh& surface, double wall_m);

/// Thickens an open sheet, which may be any soup of triangles, to `wall_m`: the result is the
/// isosurface of the distance at half of that thickness.
///
/// Errors: MESH_WALL_IMPOSSIBLE: the wall is too thin or too thick beside the sheet.
absl::StatusOr<RepairedSurface> Thicken(const SurfaceMesh& sheet, double wall_m);

}  // namespace carillon::precompute
