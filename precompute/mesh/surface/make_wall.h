// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Hollows out a closed surface that CheckSurface accepted: adds the surface at depth `wall_m`
/// inside as the wall of a cavity. The added surface is an isosurface of the signed distance. The
/// given surface stays as it is.
///
/// Errors: MESH_WALL_IMPOSSIBLE if the body is nowhere thicker than twice the wall, or if the wall
/// is too thin compared with the body.
absl::StatusOr<RepairedSurface> HollowOut(const SurfaceMesh& surface, double wall_m);

/// Returns whether a surface has two sides like a wall: whether more than half of its area has
/// another part of the surface, in front of it or behind it, within `distance_m`.
bool HasTwoSides(const SurfaceMesh& surface, double distance_m);

/// Thickens an open sheet, which may be any soup of triangles, to `wall_m`: the result is the
/// isosurface of the distance at half of that thickness.
///
/// Errors: MESH_WALL_IMPOSSIBLE if the wall is too thin or too thick compared with the sheet.
absl::StatusOr<RepairedSurface> Thicken(const SurfaceMesh& sheet, double wall_m);

}  // namespace carillon::precompute
