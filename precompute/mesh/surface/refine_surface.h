// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A surface whose triangles lie on the triangles of another surface.
struct RefinedSurface {
  SurfaceMesh surface;
  /// For each triangle the one of the original surface on which it lies.
  std::vector<int32_t> given_triangle;
};

/// Splits edges into equal parts until no edge is longer than `max_edge_m`: first the edges of the
/// given triangles, so that a long thin triangle is split across, then the edges inside them,
/// always the longest first. Inside a given triangle edges are flipped until they are Delaunay
/// (Lawson 1977), which keeps angles large. Collapsed triangles are left out. The surface must be
/// closed and manifold.
RefinedSurface RefineSurface(const SurfaceMesh& surface, double max_edge_m);

}  // namespace carillon::precompute
