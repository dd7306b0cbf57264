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

/// The curvature of a surface, for the duration of contacts.
///
/// The mean curvature H of a triangle mesh lies in its edges: an edge of length l between triangles
/// whose normals form the angle theta has the integral l theta/2. Edges below 50 degrees count as
/// facets of a round surface, and each neighbour gets half of their integral. The integrals of a
/// triangle and of its neighbours up to two edges away are summed and divided by the area of these
/// triangles, which averages the noise of scanned surfaces. Sharper edges contribute nothing to
/// adjacent faces. Convex ones, and edges without two neighbours, are sharp: within kEdgeRadiusM of
/// them, the body is like a cylinder of that radius, and like a sphere at a corner, where sharp
/// edges meet at 50 degrees or more.
class SurfaceCurvature {
 public:
  /// #V vertices in metres, #T triangles; both must outlive this.
  SurfaceCurvature(std::span<const std::array<float, 3>> vertices,
                   std::span<const std::array<uint32_t, 3>> triangles);

  /// Returns the mean curvature at `point` of triangle `triangle`, 1/m, for a body `size` times as
  /// large as the surface. It is positive where the body is convex. `point` is on the surface at
  /// its own size.
  double At(uint32_t triangle, const Point& point, double size) const;

  /// Returns each sharp edge once, as a pair of vertices.
  std::vector<std::array<uint32_t, 2>> sharp_edges() const;

  bool is_corner(uint32_t vertex) const { return sharpness_[vertex] == kCorner; }
  std::span<const std::array<float, 3>> vertices() const { return vertices_; }

 private:
  /// In units of the curvature of a cylinder.
  static constexpr uint8_t kEdge = 1, kCorner = 2;
  void FindCorners();

  std::span<const std::array<float, 3>> vertices_;
  std::span<const std::array<uint32_t, 3>> triangles_;
  std::vector<float> curvature_per_m_;  // #T
  std::vector<uint8_t> sharp_sides_;    // #T: bit i is the edge from corner i to the next
  std::vector<uint8_t> sharpness_;      // #V: zero, kEdge or kCorner
};

}  // namespace carillon
