// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/closest_point.h"

#include <cstddef>

namespace carillon {
namespace {

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

double DotProduct(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

using Weights = std::array<double, 3>;

Weights FindWeights(const std::array<Point, 3>& corners, const Point& point) {
  const auto& [a, b, c] = corners;
  const Point ab = b - a, ac = c - a;
  const Point ap = point - a, bp = point - b, cp = point - c;
  const double d1 = DotProduct(ab, ap), d2 = DotProduct(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = DotProduct(ab, bp), d4 = DotProduct(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = DotProduct(ab, cp), d6 = DotProduct(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 > 0 && d3 < 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 > 0 && d6 < 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  const double along = d4 - d3, back = d5 - d6;
  if (va <= 0 && along > 0 && back > 0) {
    return {0, back / (along + back), along / (along + back)};
  }
  const double area = va + vb + vc;
  if (!(area > 0)) return {1, 0, 0};
  return {1 - (vb + vc) / area, vb / area, vc / area};
}

}  // namespace

ClosestPoint FindClosestPoint(const std::array<Point, 3>& corners, const Point& point) {
  ClosestPoint closest{.weights = FindWeights(corners, point)};
  for (size_t axis = 0; axis < 3; ++axis) {
    double difference = -point[axis];
    for (size_t i = 0; i < 3; ++i) difference += closest.weights[i] * corners[i][axis];
    closest.squared_distance_m2 += difference * difference;
  }
  return closest;
}

}  // namespace carillon
