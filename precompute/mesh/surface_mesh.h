// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace carillon::precompute {

using Point = std::array<double, 3>;

/// A surface as it was given: vertices in metres; triangles counter-clockwise seen from outside
/// (from inside, where the whole surface was given inside out).
struct SurfaceMesh {
  std::vector<Point> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
};

}  // namespace carillon::precompute
