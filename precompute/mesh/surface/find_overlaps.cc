// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/find_overlaps.h"

#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"

namespace carillon::precompute {
namespace {

/// Parts of the diagonal.
constexpr double kRoundingPart = 0x1p-24;
constexpr double kNarrowestPart = 1e-6;
/// Greatest distance between overlapping triangles, as a part of the overlap's width.
constexpr double kFlat = 1e-3;
/// Least cosine of the angle between the planes of overlapping triangles.
constexpr double kLeastCosine = 0.999;

/// The corners of a polygon in the plane of a triangle; the third coordinate is the height above
/// that plane. A triangle cut along three lines has at most six corners.
struct Polygon {
  std::array<Point, 6> corners;
  size_t count = 0;

  void Add(const Point& corner) {
    if (count < corners.size()) corners[count++] = corner;
  }
};

/// The part of a polygon to the left of the line from `a` to `b`, by Sutherland and Hodgman's
/// algorithm.
Polygon LeftOf(const Polygon& polygon, const Point& a, const Point& b) {
  const auto side = [&](const Point& p) {
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
  };
  Polygon left;
  for (size_t i = 0; i < polygon.count; ++i) {
    const Point &p = polygon.corners[i], &q = polygon.corners[(i + 1) % polygon.count];
    const double at_p = side(p), at_q = side(q);
    if (at_p >= 0) left.Add(p);
    if ((at_p >= 0) == (at_q >= 0)) continue;
    const double t = at_p / (at_p - at_q);
    left.Add({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])});
  }
  return left;
}

/// The area of a polygon divided by its greatest extent.
double WidthOf(const Polygon& polygon) {
  double twice_area = 0, longest = 0;
  for (size_t i = 0; i < polygon.count; ++i) {
    const Point &p = polygon.corners[i], &q = polygon.corners[(i + 1) % polygon.count];
    const Point& o = polygon.corners[0];
    twice_area += (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
    for (size_t j = 0; j < i; ++j) {
      const Point& r = polygon.corners[j];
      longest = std::max(longest, std::hypot(p[0] - r[0], p[1] - r[1]));
    }
  }
  return longest > 0 ? std::abs(twice_area) / 2 / longest : 0;
}

double GreatestHeight(const Polygon& polygon) {
  double height = 0;
  for (size_t i = 0; i < polygon.count; ++i) {
    height = std::max(height, std::abs(polygon.corners[i][2]));
  }
  return height;
}

/// A triangle, and its axes: the direction of its first side, the one across it, and the normal.
struct FlatFace {
  std::array<Point, 3> corners;
  std::array<Point, 3> axes;
  double twice_area;
};

Point Scaled(const Point& p, double by) { return {p[0] * by, p[1] * by, p[2] * by}; }

FlatFace FaceOf(const std::array<Point, 3>& corners) {
  const Point side = Difference(corners[1], corners[0]), normal = AreaNormal(corners);
  const double twice_area = Norm(normal);
  if (!(twice_area > 0)) return {corners, {}, 0};
  const Point along = Scaled(side, 1 / Norm(side)), up = Scaled(normal, 1 / twice_area);
  return {corners, {along, Cross(up, along), up}, twice_area};
}

/// The corners of `face` along the axes of `plane`, from its first corner.
Polygon SeenFrom(const FlatFace& plane, const FlatFace& face) {
  Polygon seen;
  for (const Point& corner : face.corners) {
    const Point p = Difference(corner, plane.corners[0]);
    seen.Add({Dot(p, plane.axes[0]), Dot(p, plane.axes[1]), Dot(p, plane.axes[2])});
  }
  return seen;
}

bool Overlap(const FlatFace& a, const FlatFace& b, double diagonal) {
  if (std::abs(Dot(a.axes[2], b.axes[2])) < kLeastCosine) return false;
  const bool a_is_larger = a.twice_area >= b.twice_area;
  const FlatFace &larger = a_is_larger ? a : b, &smaller = a_is_larger ? b : a;
  const Polygon outline = SeenFrom(larger, larger);
  Polygon common = SeenFrom(larger, smaller);
  for (size_t i = 0; i < 3 && common.count > 0; ++i) {
    common = LeftOf(common, outline.corners[i], outline.corners[(i + 1) % 3]);
  }
  const double width = WidthOf(common);
  return width > kNarrowestPart * diagonal &&
         GreatestHeight(common) <= std::min(kRoundingPart * diagonal, kFlat * width);
}

using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, int32_t>;

Box BoxAround(const std::array<Point, 3>& corners, double margin, int32_t triangle) {
  std::array<double, 3> low = corners[0], high = corners[0];
  for (size_t i = 0; i < 3; ++i) {
    low[i] = std::min({corners[0][i], corners[1][i], corners[2][i]}) - margin;
    high[i] = std::max({corners[0][i], corners[1][i], corners[2][i]}) + margin;
  }
  return {low.data(), high.data(), triangle};
}

}  // namespace

std::vector<std::pair<int32_t, int32_t>> FindOverlaps(const SurfaceMesh& surface, size_t most) {
  std::vector<std::pair<int32_t, int32_t>> found;
  if (surface.triangles.empty()) return found;
  const double diagonal = Diagonal(surface.vertices);
  std::vector<FlatFace> faces;
  faces.reserve(surface.triangles.size());
  std::vector<Box> boxes;
  boxes.reserve(surface.triangles.size());
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    faces.push_back(FaceOf(CornersOf(surface, t)));
    if (IsCollapsed(surface.triangles[t])) continue;
    boxes.push_back(
        BoxAround(faces.back().corners, kRoundingPart * diagonal, static_cast<int32_t>(t)));
  }
  std::vector<const Box*> handles;
  handles.reserve(boxes.size());
  for (const Box& box : boxes) handles.push_back(&box);
  CGAL::box_self_intersection_d(handles.begin(), handles.end(), [&](const Box* a, const Box* b) {
    const auto [first, second] = std::minmax({a->info(), b->info()});
    if (found.size() >= most) return;
    if (Overlap(faces[static_cast<size_t>(first)], faces[static_cast<size_t>(second)], diagonal)) {
      found.emplace_back(first, second);
    }
  });
  std::ranges::sort(found);
  return found;
}

}  // namespace carillon::precompute
