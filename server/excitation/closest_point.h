// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "server/excitation/contact.h"

namespace carillon {

/// A point of a triangle, and its distance from another point.
struct ClosestPoint {
  std::array<double, 3> weights{};  ///< barycentric
  double squared_distance_m2 = 0;
};

/// Returns the point of the triangle `corners` (metres) that is nearest to `point`. The function
/// rules out the Voronoi regions of the vertices and edges one after the other (Ericson, Real-Time
/// Collision Detection, 5.1.5). A triangle without area is treated as its edges.
ClosestPoint FindClosestPoint(const std::array<Point, 3>& corners, const Point& point);

}  // namespace carillon
