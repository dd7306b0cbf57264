// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// These functions repair single places of a surface and keep all other triangles. Each edge of the
/// given surface must have one or two triangles. If a function cannot repair the surface, it
/// returns nothing.

/// Fills holes with smooth patches. A hole is filled if its rim is at most as long as the diagonal,
/// and if all patches together have at most a twentieth of the area. A wider hole is taken for the
/// mouth of a vessel.
std::optional<RepairedSurface> FillHoles(const SurfaceMesh& surface);

/// Replaces the triangles where a closed surface lies folded on itself except for rounding, with
/// the limits of Untangle. The result passes CheckSurface.
std::optional<RepairedSurface> Unfold(const SurfaceMesh& surface);

/// Replaces the triangles around places where a closed surface crosses itself. The change is made
/// only if the given surface and the result are nowhere further from each other than a thousandth
/// of the diagonal.
std::optional<RepairedSurface> Untangle(const SurfaceMesh& surface);

}  // namespace carillon::precompute
