// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns whether two corners of a triangle are the same vertex. Such a collapsed triangle keeps
/// its index in the surface and is ignored otherwise, because it neither closes nor opens a gap.
bool IsCollapsed(const std::array<int32_t, 3>& triangle);

/// Triangles that are connected by their edges.
struct Shell {
  std::vector<int32_t> triangles;
  /// The signed volume, m^3, which is negative if the triangles are clockwise seen from outside.
  /// The volume of an open shell has no meaning.
  double volume_m3;
};

/// Returns the shells of a surface; the shell with the greatest volume comes first.
std::vector<Shell> FindShells(const SurfaceMesh& surface);

/// Returns the winding number of a closed shell around `point`: 0 outside, 1 inside, and -1 inside
/// a shell that is inside out. Van Oosterom and Strackee, The solid angle of a plane triangle, IEEE
/// Trans. Biomed. Eng. 1983.
double WindingNumber(const SurfaceMesh& surface, const Shell& shell, const Point& point);

/// Returns a point inside a closed shell that does not cross itself.
Point PointInside(const SurfaceMesh& surface, const Shell& shell);

}  // namespace carillon::precompute
