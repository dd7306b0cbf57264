// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

inline Point Difference(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline double Dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Point Cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double Norm(const Point& a) { return std::hypot(a[0], a[1], a[2]); }

inline double Distance(const Point& a, const Point& b) { return Norm(Difference(a, b)); }

/// Returns the signed volume of the tetrahedron a, b, c, d. It is positive if a, b, c are
/// counter-clockwise seen from d.
inline double TetVolume(const Point& a, const Point& b, const Point& c, const Point& d) {
  return Dot(Cross(Difference(b, a), Difference(c, a)), Difference(d, a)) / 6;
}

/// Returns the three corners of triangle `t`.
inline std::array<Point, 3> CornersOf(const SurfaceMesh& surface, size_t t) {
  const auto& triangle = surface.triangles[t];
  return {surface.vertices[static_cast<size_t>(triangle[0])],
          surface.vertices[static_cast<size_t>(triangle[1])],
          surface.vertices[static_cast<size_t>(triangle[2])]};
}

/// Returns the centroid of a triangle.
inline Point MiddleOf(const std::array<Point, 3>& corner) {
  Point middle;
  for (size_t i = 0; i < 3; ++i) middle[i] = (corner[0][i] + corner[1][i] + corner[2][i]) / 3;
  return middle;
}

/// Returns the length of the diagonal of the box around `points`, which must not be empty.
inline double Diagonal(const std::vector<Point>& points) {
  Point low = points.front(), high = low;
  for (const Point& p : points) {
    for (size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  return Distance(low, high);
}

/// Returns the unit normal of a triangle times twice the triangle's area.
inline Point AreaNormal(const std::array<Point, 3>& corner) {
  return Cross(Difference(corner[1], corner[0]), Difference(corner[2], corner[0]));
}

}  // namespace carillon::precompute
