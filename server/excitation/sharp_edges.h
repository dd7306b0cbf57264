// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/excitation/contact.h"

namespace carillon {

/// The sharp edges and corners of a surface, at which bodies touch first.
///
/// A physics engine lets bodies overlap by some millimetres before it separates them, and some
/// engines round corners off. A reported contact may therefore lie inside a body. Next to an edge,
/// the nearest point of the surface is then on a face, where a contact has a tenth of the duration
/// that it has on an edge.
class SharpEdges {
 public:
  /// Surfaces with more edges than this count as rough, and their edges are not used.
  static constexpr size_t kMostEdges = 4096;

  /// `edges` are pairs of `vertices` (metres).
  SharpEdges(std::span<const std::array<float, 3>> vertices,
             std::span<const std::array<uint32_t, 2>> edges);

  /// Returns the point of an edge that an engine's contact at `point` probably means, if there is
  /// one. `depth_m` is the distance of `point` from the surface. Among the points of edges within
  /// three times `depth_m`, and within 60 degrees of the direction against `impulse`, this is the
  /// point farthest in that direction.
  std::optional<Point> Protruding(const Point& point, double depth_m,
                                  const std::array<double, 3>& impulse) const;

 private:
  std::vector<std::array<Point, 2>> edges_;
};

}  // namespace carillon
