// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/excitation/contact.h"
#include "server/excitation/surface_curvature.h"

namespace carillon {

/// The sharp edges and corners of a surface, at which bodies touch first.
///
/// A physics engine lets bodies overlap by some millimetres before it separates them, and some
/// engines round corners off. A reported contact may therefore lie inside a body, and the contacts
/// of a face that lands flat beside its corners. The nearest point of the surface is then on a
/// face, where a contact has about half of the duration that it has at a corner.
class SharpEdges {
 public:
  explicit SharpEdges(const SurfaceCurvature& curvature);

  /// Returns the point of an edge that an engine's contact at `point` within the body probably
  /// means, if there is one. `depth_m` is the distance of `point` from the surface. Among the
  /// points of edges within three times `depth_m`, and within 60 degrees of the direction against
  /// `impulse`, this is the point farthest in that direction.
  std::optional<Point> Protruding(const Point& point, double depth_m,
                                  const std::array<double, 3>& impulse) const;

  /// Returns the corner nearest to `point` within `tolerance_m` or, if there is none, the point of
  /// an edge. Points within 60 degrees of the direction of `impulse` lie behind the surface that is
  /// struck, and do not count.
  std::optional<Point> Beside(const Point& point, double tolerance_m,
                              const std::array<double, 3>& impulse) const;

 private:
  struct Edge {
    std::array<Point, 2> ends{};
    std::array<bool, 2> is_corner{};  ///< of each end, whether edges meet there at an angle
    double begin_m = 0;               ///< the lower coordinate of the ends along axis_
  };

  /// Returns a range that holds all edges within `reach_m` of `point`.
  std::span<const Edge> Around(const Point& point, double reach_m) const;

  size_t axis_ = 0;          // along which the edges extend farthest
  std::vector<Edge> edges_;  // ascending by begin_m
  double longest_m_ = 0;     // the extent along axis_ of the edge that has the greatest
};

}  // namespace carillon
