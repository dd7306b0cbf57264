// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace carillon::precompute {

using Point = std::array<double, 3>;

/// A surface: vertices in metres, and triangles counter-clockwise seen from outside. The triangles
/// of a surface that was given inside out are clockwise.
struct SurfaceMesh {
  std::vector<Point> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
};

}  // namespace carillon::precompute
