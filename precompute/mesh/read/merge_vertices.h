// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns the surface of triangles that are given by their corners. Corners with exactly the same
/// position become one vertex. Vertices are numbered in the order of first use, and the order and
/// number of triangles stay the same.
SurfaceMesh MergeVertices(const std::vector<std::array<Point, 3>>& triangles);

}  // namespace carillon::precompute
