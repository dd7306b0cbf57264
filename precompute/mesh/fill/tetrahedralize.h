// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

struct MeshingSettings {
  /// Keep the vertices of the surface and add none on it; unset: decided from the surface.
  std::optional<bool> keep_surface = std::nullopt;
  /// About how many corner nodes the mesh should have; zero: decided from the surface.
  int target_node_count = 0;
  /// How coarse the mesh may be on its surface, as Grain() measures it, in metres; zero: no matter.
  double grain_m = 0;
  /// 4 or 10. Mid-side nodes lie on straight edges.
  int nodes_per_element = 10;
  /// As FillRequest::cautious.
  bool cautious = false;
};

/// Fills a surface that CheckSurface accepted with tetrahedra; cavities stay empty. Each face of
/// the mesh's boundary names the given triangle it lies on. The mesher runs in a child process, so
/// that input it crashes on is refused like any other.
///
/// Errors: MESH_TETRAHEDRALIZATION_FAILED, MESH_TOO_LARGE, OUT_OF_MEMORY.
absl::StatusOr<TetMesh> Tetrahedralize(const SurfaceMesh& surface, const MeshingSettings& settings);

}  // namespace carillon::precompute
