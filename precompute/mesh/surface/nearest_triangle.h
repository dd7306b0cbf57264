// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Finds the point of a surface that is nearest to a given point, or the first triangle along a
/// ray. The surface may be any soup of triangles with at least one triangle of positive area.
class NearestTriangle {
 public:
  explicit NearestTriangle(const SurfaceMesh& surface);
  ~NearestTriangle();

  struct Place {
    int32_t triangle;
    Point point;
    double distance_m;
  };
  Place Find(const Point& point) const;

  /// Returns the distance, metres, from `point` to the first triangle that a ray in `direction` (of
  /// any length above zero) meets farther away than `least_m`. Returns infinity if it meets none.
  double DistanceAlong(const Point& point, const Point& direction, double least_m) const;

 private:
  struct Index;
  std::unique_ptr<Index> index_;
};

/// Returns the greatest distance, metres, of the vertices and triangle centroids of `surface` from
/// `other`.
double GreatestDistance(const SurfaceMesh& surface, const NearestTriangle& other);

}  // namespace carillon::precompute
