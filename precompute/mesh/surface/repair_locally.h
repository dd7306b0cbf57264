// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// These functions repair single places of a surface and keep all other triangles. Each edge of the
/// given surface must have one or two triangles. If a function cannot repair the surface, it
/// returns nothing.

/// Closes the holes of a surface whose only holes are parts of flat faces, such as a box that lacks
/// one triangle. Such a hole has a plane rim of a few edges, beside which the surface continues in
/// the same plane. It is closed in this plane whatever its size, because no other body is meant.
std::optional<RepairedSurface> CloseFlatFaces(const SurfaceMesh& surface);

/// Fills holes: those in flat faces as CloseFlatFaces does, and others with smooth patches. These
/// are filled if their rim is at most as long as the diagonal, and if all patches together have at
/// most a twentieth of the area. A wider hole is taken for the mouth of a vessel.
std::optional<RepairedSurface> FillHoles(const SurfaceMesh& surface);

/// Returns the width of the widest hole of a surface in one shell, metres: four times the area of
/// the rim's projection onto its plane, divided by the rim's length. A slit has twice its width.
/// Returns zero if the surface has several shells, or no hole.
double WidestHole(const SurfaceMesh& surface);

/// Replaces the triangles where a closed surface lies folded on itself except for rounding, with
/// the limits of Untangle. The result passes CheckSurface.
std::optional<RepairedSurface> Unfold(const SurfaceMesh& surface);

/// Replaces the triangles around places where a closed surface crosses itself. The change is made
/// only if the given surface and the result are nowhere further from each other than a thousandth
/// of the diagonal.
std::optional<RepairedSurface> Untangle(const SurfaceMesh& surface);

}  // namespace carillon::precompute
