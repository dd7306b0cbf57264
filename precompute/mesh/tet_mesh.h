// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A face of the boundary, counter-clockwise seen from outside: three corners, then the mid-side
/// nodes between corners 0-1, 1-2 and 2-0. The mid-side nodes of a linear element are -1.
struct BoundaryFace {
  std::array<int32_t, 6> nodes;
  /// The triangle of the given surface on which this face lies.
  int32_t given_triangle;
};

/// Corners of the edges of a tetrahedron, in the order of their mid-side nodes.
inline constexpr std::array<std::array<int, 2>, 6> kTetEdges = {
    {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};

/// Corners of the faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
inline constexpr std::array<std::array<int, 3>, 4> kTetFaces = {
    {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};

/// Four triangles that make up a face with mid-side nodes, by the places of their corners among the
/// nodes of the face, which are in the order of BoundaryFace.
inline constexpr std::array<std::array<size_t, 3>, 4> kFaceInFour = {
    {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};

/// A mesh of tetrahedra of 4 or 10 nodes.
struct TetMesh {
  std::vector<Point> nodes;  ///< metres
  int nodes_per_element = 4;
  /// Element e has nodes elements[e * nodes_per_element ...]: four corners of positive signed
  /// volume, then the mid-side nodes of edges 0-1, 1-2, 2-0, 0-3, 1-3, 2-3.
  std::vector<int32_t> elements;
  std::vector<BoundaryFace> boundary;
  /// Fixed nodes, ascending; empty if the body is free.
  std::vector<int32_t> fixed = {};
  /// The number of the region of each element; empty if the body has one region.
  std::vector<int32_t> regions = {};

  size_t element_count() const { return elements.size() / static_cast<size_t>(nodes_per_element); }
  size_t RegionOf(size_t element) const {
    return regions.empty() ? 0 : static_cast<size_t>(regions[element]);
  }
};

}  // namespace carillon::precompute
