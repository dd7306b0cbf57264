// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Whether two corners are the same vertex. Such a triangle neither closes nor opens a gap; it
/// keeps its index in the surface and is ignored otherwise.
bool IsCollapsed(const std::array<int32_t, 3>& triangle);

/// Triangles that are connected by their edges.
struct Shell {
  std::vector<int32_t> triangles;
  /// m^3; negative where the triangles turn clockwise seen from outside. Meaningless if open.
  double volume_m3;
};

/// The shells of a surface, the one of greatest volume first.
std::vector<Shell> FindShells(const SurfaceMesh& surface);

/// The winding number of a closed shell around `point`: 0 outside, 1 inside, -1 inside a shell that
/// is inside out. Van Oosterom and Strackee, The solid angle of a plane triangle, IEEE Trans.
/// Biomed. Eng. 1983.
double WindingNumber(const SurfaceMesh& surface, const Shell& shell, const Point& point);

/// A point inside a closed shell that does not cross itself.
Point PointInside(const SurfaceMesh& surface, const Shell& shell);

}  // namespace carillon::precompute
