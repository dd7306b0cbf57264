// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/mesh/size_field.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A surface whose triangles lie on the triangles of another surface.
struct RefinedSurface {
  SurfaceMesh surface;
  /// For each triangle, the triangle of the original surface on which it lies.
  std::vector<int32_t> given_triangle;
};

/// Splits edges into equal parts until no edge is longer than `max_edge_m` times the relative size
/// at the middle of the edge. The edges of the given triangles are split first, so that a long thin
/// triangle is split across its length. The edges inside the given triangles follow, always the
/// longest one first. Inside each given triangle, edges are flipped until they are Delaunay (Lawson
/// 1977), which keeps angles large. Collapsed triangles are left out. The surface must be closed,
/// and manifold but for walls inside it.
RefinedSurface RefineSurface(const SurfaceMesh& surface, double max_edge_m,
                             const SizeField& relative_size = {});

}  // namespace carillon::precompute
