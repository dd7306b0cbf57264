// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/excitation/contact.h"

namespace carillon {

/// The radius to which the sharp edges and corners of real bodies are taken to be rounded.
inline constexpr double kEdgeRadiusM = 0.0005;

/// The curvature of a surface, as far as the duration of a contact needs it.
///
/// The mean curvature H of a triangle mesh lies in its edges: an edge of length l between triangles
/// whose normals form the angle theta has the integral l theta/2. Edges below 50 degrees count as
/// the facets of a round surface; half of their integral belongs to each neighbour, and the sum is
/// divided by the area of the triangle and of its neighbours up to two edges away, which averages
/// the noise of scanned surfaces. Sharper edges, and edges without two neighbours, are edges of the
/// body. They contribute nothing to faces beside them, and within kEdgeRadiusM of them the body is
/// as sharp as a cylinder (an edge) or a sphere (a corner) of that radius.
class SurfaceCurvature {
 public:
  /// #V vertices in metres, #T triangles; both must outlive this.
  SurfaceCurvature(std::span<const std::array<float, 3>> vertices,
                   std::span<const std::array<uint32_t, 3>> triangles);

  /// The mean curvature at `point` of triangle `triangle` of a body `size` times as large as the
  /// surface, 1/m; above zero where the body bulges. `point` is on the surface at its own size.
  double At(uint32_t triangle, const Point& point, double size) const;

  /// The sharp edges as pairs of vertices, each once.
  std::vector<std::array<uint32_t, 2>> sharp_edges() const;

 private:
  std::span<const std::array<float, 3>> vertices_;
  std::span<const std::array<uint32_t, 3>> triangles_;
  std::vector<float> curvature_per_m_;  // #T
  std::vector<uint8_t> sharp_sides_;    // #T: bit i is the edge from corner i to the next
};

}  // namespace carillon
