// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Finds the nearest point of a surface, which may be any soup of triangles with at least one
/// triangle of positive area.
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

 private:
  struct Index;
  std::unique_ptr<Index> index_;
};

/// The greatest distance, metres, of the vertices and the triangles' middles of a surface from
/// another.
double GreatestDistance(const SurfaceMesh& surface, const NearestTriangle& other);

}  // namespace carillon::precompute
