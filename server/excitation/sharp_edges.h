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
/// engines round corners off. The contact that they report may therefore lie inside a body. Next to
/// an edge the nearest point of the surface is then on a face, and a face meets another body for a
/// tenth of an edge's time.
class SharpEdges {
 public:
  /// Surfaces with more edges than this are rough, and have none by which to find a contact.
  static constexpr size_t kMostEdges = 4096;

  /// `edges` are pairs of `vertices` (metres).
  SharpEdges(std::span<const std::array<float, 3>> vertices,
             std::span<const std::array<uint32_t, 2>> edges);

  /// Returns the point of an edge that an engine's contact at `point` means: within three
  /// times `depth_m`, the distance of `point` from the surface, the one that is farthest against
  /// `impulse`, and within 60 degrees of that direction. Absent if there is none.
  std::optional<Point> Protruding(const Point& point, double depth_m,
                                  const std::array<double, 3>& impulse) const;

 private:
  std::vector<std::array<Point, 2>> edges_;
};

}  // namespace carillon
