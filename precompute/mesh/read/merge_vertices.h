// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The surface of triangles given by their corners: corners at exactly the same place become one
/// vertex, numbered in the order of first use; triangles keep order and count.
SurfaceMesh MergeVertices(const std::vector<std::array<Point, 3>>& triangles);

}  // namespace carillon::precompute
