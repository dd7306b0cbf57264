// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Splits a polygon, which need not be convex or quite flat, into triangles by cutting off ears:
/// corners whose triangle contains no other corner, seen along the polygon's normal. The result has
/// two triangles less than the polygon has corners, with its direction, also if the polygon crosses
/// itself.
void Triangulate(std::span<const int32_t> polygon, const std::vector<Point>& vertices,
                 std::vector<std::array<int32_t, 3>>& triangles);

}  // namespace carillon::precompute
