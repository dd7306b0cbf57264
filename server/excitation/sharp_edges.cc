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

SharpEdges::SharpEdges(const SurfaceCurvature& curvature) {
  const auto vertices = curvature.vertices();
  const auto at = [&](uint32_t vertex) {
    return Point{vertices[vertex][0], vertices[vertex][1], vertices[vertex][2]};
  };
  Point least{}, most{};
  for (const auto& [from, to] : curvature.sharp_edges()) {
    edges_.push_back({.ends = {at(from), at(to)},
                      .is_corner = {curvature.is_corner(from), curvature.is_corner(to)}});
    for (size_t i = 0; i < 3; ++i) {
      const auto [low, high] = std::minmax(edges_.back().ends[0][i], edges_.back().ends[1][i]);
      least[i] = edges_.size() == 1 ? low : std::min(least[i], low);
      most[i] = edges_.size() == 1 ? high : std::max(most[i], high);
    }
  }
  const Point extent = Between(least, most);
  axis_ = static_cast<size_t>(std::ranges::max_element(extent) - extent.begin());
  for (Edge& edge : edges_) {
    const auto [low, high] = std::minmax(edge.ends[0][axis_], edge.ends[1][axis_]);
    edge.begin_m = low;
    longest_m_ = std::max(longest_m_, high - low);
  }
  std::ranges::stable_sort(edges_, {}, &Edge::begin_m);
}

std::span<const SharpEdges::Edge> SharpEdges::Around(const Point& point, double reach_m) const {
  const auto first =
      std::ranges::lower_bound(edges_, point[axis_] - reach_m - longest_m_, {}, &Edge::begin_m);
  const auto last =
      std::ranges::upper_bound(first, edges_.end(), point[axis_] + reach_m, {}, &Edge::begin_m);
  return {first, last};
}

std::optional<Point> SharpEdges::Protruding(const Point& point, double depth_m,
                                            const std::array<double, 3>& impulse) const {
  const double reach_m = kReach * depth_m, strength = std::sqrt(Along(impulse, impulse));
  if (reach_m < kEdgeRadiusM || strength == 0) return std::nullopt;
  std::optional<Point> found;
  double farthest_m = 0;
  for (const Edge& edge : Around(point, reach_m)) {
    for (const Point& place : {edge.ends[0], edge.ends[1], NearestOf(edge.ends, point)}) {
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

std::optional<Point> SharpEdges::Beside(const Point& point, double tolerance_m,
                                        const std::array<double, 3>& impulse) const {
  const double strength = std::sqrt(Along(impulse, impulse));
  std::optional<Point> corner, on_edge;
  double to_corner_m = tolerance_m, to_edge_m = tolerance_m;
  const auto consider = [&](const Point& place, double& nearest_m, std::optional<Point>& found) {
    const Point way = Between(point, place);
    const double distance_m = std::sqrt(Along(way, way));
    const bool behind = Along(way, impulse) > kLeastCosine * distance_m * strength;
    if (distance_m > nearest_m || behind) return;
    nearest_m = distance_m;
    found = place;
  };
  for (const Edge& edge : Around(point, tolerance_m)) {
    consider(NearestOf(edge.ends, point), to_edge_m, on_edge);
    for (size_t i = 0; i < edge.ends.size(); ++i) {
      if (edge.is_corner[i]) consider(edge.ends[i], to_corner_m, corner);
    }
  }
  return corner ? corner : on_edge;
}

}  // namespace carillon
