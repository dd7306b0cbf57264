// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/refine_surface.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// A closed surface of about unit size, and requirements on the tetrahedra inside it.
struct FillRequest {
  const RefinedSurface& surface;
  /// A point in each cavity.
  std::vector<Point> cavities;
  /// Whether the surface has walls inside the body, which divide it into spaces.
  bool has_walls = false;
  /// Largest volume of a tetrahedron, in the surface's unit of length cubed, where the relative
  /// size is 1. The bound is proportional to the cube of the relative size.
  double max_volume;
  const SizeField& relative_size;
  /// Whether to add no vertices on the surface.
  bool keep_surface;
  /// Largest number of vertices to add.
  int max_added_nodes;
  /// Processor time after which TetGen is stopped. It refines some surfaces without end.
  std::chrono::seconds most_cpu;
  /// Whether TetGen tolerates larger defects of the surface and worse shapes of the tetrahedra.
  /// Useful for a surface on which TetGen has failed.
  bool cautious = false;
};

/// Fills the surface with 4-node tetrahedra, in a child process because TetGen crashes on some
/// inputs. Each boundary face stores its given triangle, and each element the number of its
/// space if there are walls. Errors: MESH_TETRAHEDRALIZATION_FAILED,
/// OUT_OF_MEMORY.
absl::StatusOr<TetMesh> FillWithTetgen(const FillRequest& request);

}  // namespace carillon::precompute
