// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/nearest_triangle.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

using TreeKernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<TreeKernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<TreeKernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<TreeKernel, Primitive>>;

TreeKernel::Point_3 ToCgal(const Point& p) { return {p[0], p[1], p[2]}; }

}  // namespace

struct NearestTriangle::Index {
  Triangles triangles;
  std::vector<int32_t> numbers;  // of each in the surface
  Tree tree;
};

NearestTriangle::NearestTriangle(const SurfaceMesh& surface) : index_(std::make_unique<Index>()) {
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto [a, b, c] = CornersOf(surface, t);
    const TreeKernel::Triangle_3 triangle(ToCgal(a), ToCgal(b), ToCgal(c));
    if (triangle.is_degenerate()) continue;
    index_->triangles.push_back(triangle);
    index_->numbers.push_back(static_cast<int32_t>(t));
  }
  index_->tree.insert(index_->triangles.begin(), index_->triangles.end());
  index_->tree.accelerate_distance_queries();
}

NearestTriangle::~NearestTriangle() = default;

NearestTriangle::Place NearestTriangle::Find(const Point& point) const {
  const auto [nearest, triangle] = index_->tree.closest_point_and_primitive(ToCgal(point));
  const Point found = {nearest.x(), nearest.y(), nearest.z()};
  const auto number = static_cast<size_t>(triangle - index_->triangles.cbegin());
  return {index_->numbers[number], found, Distance(point, found)};
}

double NearestTriangle::DistanceAlong(const Point& point, const Point& direction,
                                      double least_m) const {
  const double length = Norm(direction);
  Point start = point;
  for (size_t x = 0; x < 3; ++x) start[x] += least_m / length * direction[x];
  const TreeKernel::Vector_3 along(direction[0], direction[1], direction[2]);
  const auto met = index_->tree.first_intersection(TreeKernel::Ray_3(ToCgal(start), along));
  if (!met) return std::numeric_limits<double>::infinity();
  // A ray within a triangle's plane meets it in a segment.
  const auto* place = boost::get<TreeKernel::Point_3>(&met->first);
  if (place == nullptr) return least_m;
  return Distance(point, {place->x(), place->y(), place->z()});
}

double GreatestDistance(const SurfaceMesh& surface, const NearestTriangle& other) {
  double distance = 0;
  for (const Point& p : surface.vertices) distance = std::max(distance, other.Find(p).distance_m);
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    distance = std::max(distance, other.Find(MiddleOf(CornersOf(surface, t))).distance_m);
  }
  return distance;
}

}  // namespace carillon::precompute
