// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "precompute/mesh/size_field.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

struct MeshingSettings {
  /// Whether to keep the vertices of the surface and add none on it. If unset, the choice depends
  /// on the surface.
  std::optional<bool> keep_surface = std::nullopt;
  /// Approximate number of corner nodes of the mesh. If zero, the number is chosen from the
  /// surface.
  int target_node_count = 0;
  /// Largest element size on the surface, metres, as SurfaceElementSize() measures it. Zero means
  /// no limit.
  double element_size_m = 0;
  /// Element size relative to `element_size_m`, in the places of the surface in metres. Only used
  /// with `element_size_m`.
  SizeField relative_size = {};
  /// Number of nodes, mid-side nodes included, above which the mesh is of no use. Meshing may stop
  /// beyond it. Zero means no limit.
  double most_node_count = 0;
  /// Number of nodes of an element, 4 or 10. Mid-side nodes lie on straight edges.
  int nodes_per_element = 10;
  /// Whether the mesher tolerates larger defects of the surface and worse shapes of the tetrahedra.
  bool cautious = false;
};

/// Fills a surface that CheckSurface accepted with tetrahedra; cavities stay empty. Each face of
/// the mesh's boundary stores the given triangle that it lies on. The mesher runs in a child
/// process, so that a crash of the mesher becomes an ordinary error.
///
/// `walls` are triangles of the surface's vertices, and divide the body into spaces; the mesh then
/// has the number of a space for each element in TetMesh::regions, and no element crosses a wall.
///
/// Errors: MESH_TETRAHEDRALIZATION_FAILED, MESH_TOO_LARGE, OUT_OF_MEMORY.
absl::StatusOr<TetMesh> Tetrahedralize(const SurfaceMesh& surface, const MeshingSettings& settings,
                                       std::span<const std::array<int32_t, 3>> walls = {});

}  // namespace carillon::precompute
