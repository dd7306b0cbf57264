// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/sharp_edges.h"

#include <algorithm>
#include <cmath>

#include "server/excitation/surface_curvature.h"

namespace carillon {
namespace {

/// Cosine of the greatest angle between the direction against the impulse and the direction to a
/// point of an edge.
constexpr double kLeastCosine = 0.5;
/// Reach in units of the depth. A cube's corner is sqrt(3) times as far from an inner point as its
/// faces are if these are equally far, and otherwise farther.
constexpr double kReach = 3;

double Along(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Point Between(const Point& from, const Point& to) {
  return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

Point NearestOf(const std::array<Point, 2>& edge, const Point& point) {
  const Point along = Between(edge[0], edge[1]);
  const double square = Along(along, along);
  const double share =
      square > 0 ? std::clamp(Along(Between(edge[0], point), along) / square, 0.0, 1.0) : 0;
  return {edge[0][0] + share * along[0], edge[0][1] + share * along[1],
          edge[0][2] + share * along[2]};
}

}  // namespace

SharpEdges::SharpEdges(std::span<const std::array<float, 3>> vertices,
                       std::span<const std::array<uint32_t, 2>> edges) {
  if (edges.size() > kMostEdges) return;
  const auto at = [&](uint32_t vertex) {
    return Point{vertices[vertex][0], vertices[vertex][1], vertices[vertex][2]};
  };
  for (const auto& [from, to] : edges) edges_.push_back({at(from), at(to)});
}

std::optional<Point> SharpEdges::Protruding(const Point& point, double depth_m,
                                            const std::array<double, 3>& impulse) const {
  const double reach_m = kReach * depth_m, strength = std::sqrt(Along(impulse, impulse));
  // This close to an edge, the surface's curvature is that of the edge anyway.
  if (reach_m < kEdgeRadiusM || strength == 0) return std::nullopt;
  std::optional<Point> found;
  double farthest_m = 0;
  for (const std::array<Point, 2>& edge : edges_) {
    for (const Point& place : {edge[0], edge[1], NearestOf(edge, point)}) {
      const Point way = Between(point, place);
      const double distance_m = std::sqrt(Along(way, way));
      const double out_m = -Along(way, impulse) / strength;
      if (distance_m > reach_m || out_m < kLeastCosine * distance_m || out_m <= farthest_m)
        continue;
      farthest_m = out_m;
      found = place;
    }
  }
  return found;
}

}  // namespace carillon
