// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <span>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A point of a quadrature rule on a triangle.
struct TrianglePoint {
  std::array<double, 3> hat;  ///< barycentric coordinates
  double weight;              ///< fraction of the area; all weights sum to one
};

/// Returns three inner points, exact to degree 2.
std::span<const TrianglePoint> CoarseTriangleRule();
/// Returns Radon's seven points, exact to degree 5.
std::span<const TrianglePoint> MediumTriangleRule();
/// Returns Radon's rule on each quarter of the triangle, which has 28 points.
std::span<const TrianglePoint> FineTriangleRule();

Point PlaceIn(const std::array<Point, 3>& corner, const std::array<double, 3>& hat);

}  // namespace carillon::precompute
