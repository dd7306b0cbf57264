// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/far_origin.h"

#include <algorithm>
#include <cmath>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {

Point FarOrigin(const std::vector<Point>& points) {
  constexpr double kMostDiagonals = 256;
  Point low = points.front();
  double most = 0;
  for (const Point& p : points) {
    for (size_t x = 0; x < 3; ++x) {
      low[x] = std::min(low[x], p[x]);
      most = std::max(most, std::abs(p[x]));
    }
  }
  const double diagonal = Diagonal(points);
  if (!(diagonal > 0) || !(most > kMostDiagonals * diagonal)) return {0, 0, 0};
  const double step = std::pow(10, std::ceil(std::log10(diagonal)));
  Point origin;
  for (size_t x = 0; x < 3; ++x) origin[x] = step * std::floor(low[x] / step);
  return origin;
}

void CountFrom(const Point& origin, NamedMesh& named) {
  if (origin == Point{0, 0, 0}) return;
  for (Point& p : named.points()) p = Difference(p, origin);
  for (auto& [number, p] : named.names.vertices) p = Difference(p, origin);
  named.names.origin_m = origin;
}

}  // namespace carillon::precompute
