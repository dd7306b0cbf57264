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

/// Vertices by their numbers, see MeshNames: the node nearest to each, and all of a given triangle
/// or edge whose corners are held.
struct HeldVertices {
  std::vector<int64_t> numbers;
};

/// What lies in a plane or behind it, away from its normal.
struct HeldPlane {
  Point point_m;
  Point normal;  ///< of any length above zero
};

/// What lies in a box or on it.
struct HeldBox {
  Point low_m;
  Point high_m;
};

/// A group that the file names.
struct HeldGroup {
  std::string name;
};

using Fixture = std::variant<HeldVertices, HeldPlane, HeldBox, HeldGroup>;

/// Fills `mesh.held` with the nodes that the fixtures hold, mid-side nodes too; places count as one
/// within a millionth of the body's diagonal.
/// `given`: the surface to which the boundary of `mesh` refers.
///
/// Errors: NO_VERTEX_HELD (by one of the fixtures), ALL_VERTICES_HELD, GROUP_UNKNOWN.
absl::Status Hold(const std::vector<Fixture>& fixtures, const SurfaceMesh& given,
                  const MeshNames& names, TetMesh& mesh);

}  // namespace carillon::precompute
