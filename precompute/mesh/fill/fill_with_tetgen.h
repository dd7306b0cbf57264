// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/refine_surface.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// A closed surface of about unit size and what is wanted of the tetrahedra inside.
struct FillRequest {
  const RefinedSurface& surface;
  /// A point in each cavity.
  std::vector<Point> cavities;
  /// No tetrahedron is larger, in units of the surface cubed.
  double max_volume;
  /// Adds no vertex on the surface.
  bool keep_surface;
  /// Adds at most so many vertices.
  int max_added_nodes;
  /// For a surface that the mesher came to grief over: tolerates more in the surface and asks for
  /// less in the shape of the tetrahedra.
  bool cautious = false;
};

/// Fills the surface with 4-node tetrahedra, in a process of its own: TetGen crashes on input it
/// does not like. Each boundary face names its given triangle. Errors:
/// MESH_TETRAHEDRALIZATION_FAILED, OUT_OF_MEMORY.
absl::StatusOr<TetMesh> FillWithTetgen(const FillRequest& request);

}  // namespace carillon::precompute
