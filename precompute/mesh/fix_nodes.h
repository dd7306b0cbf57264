// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Vertices, identified by their numbers (see MeshNames). The node nearest to each vertex is fixed.
/// If all corners of a given triangle or edge are listed, all nodes on it are fixed, too.
struct FixedVertices {
  std::vector<int64_t> numbers;
};

/// A half space: all nodes in a plane or behind it, that is, on the side opposite to its normal.
struct FixedPlane {
  Point point_m;
  Point normal;  ///< of any length above zero
};

/// All nodes in a box or on its surface.
struct FixedBox {
  Point low_m;
  Point high_m;
};

/// A group of the mesh file.
struct FixedGroup {
  std::string name;
};

using Fixture = std::variant<FixedVertices, FixedPlane, FixedBox, FixedGroup>;

/// Applies boundary conditions: fills `mesh.fixed` with the nodes in the regions of the fixtures,
/// including mid-side nodes. The tolerance of a region is a millionth of the body's diagonal.
/// `given` is the surface to which the boundary of `mesh` refers.
///
/// Errors: NO_VERTEX_FIXED (a fixture contains no node), ALL_VERTICES_FIXED, GROUP_UNKNOWN.
absl::Status FixNodes(const std::vector<Fixture>& fixtures, const SurfaceMesh& given,
                      const MeshNames& names, TetMesh& mesh);

}  // namespace carillon::precompute
