// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// These functions repair single places of a surface and keep all other triangles. Each edge of the
/// given surface has one or two triangles. They return nothing if they cannot repair the surface.

/// Fills holes with smooth patches: those with a rim of at most the diagonal's length whose patches
/// together have at most a twentieth of the area. A wider hole is the mouth of a vessel.
std::optional<RepairedSurface> FillHoles(const SurfaceMesh& surface);

/// Replaces the triangles where a closed surface lies folded on itself except for rounding, with
/// the limits of Untangle. The result passes CheckSurface.
std::optional<RepairedSurface> Unfold(const SurfaceMesh& surface);

/// Replaces the triangles about places where a closed surface crosses itself, if no part of the
/// result is further than a thousandth of the diagonal from the surface, or the reverse.
std::optional<RepairedSurface> Untangle(const SurfaceMesh& surface);

}  // namespace carillon::precompute
