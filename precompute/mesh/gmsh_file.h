// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// What a Gmsh file says of tetrahedra, not yet checked.
struct GmshFile {
  std::vector<int32_t> node_numbers;  ///< as the file numbers its nodes
  std::vector<Point> nodes;           ///< their places
  int nodes_per_element = 0;          ///< 4 or 10; 0 where there is no tetrahedron
  /// Node numbers of each tetrahedron, in Gmsh's order.
  std::vector<int32_t> elements;
};

/// Splits a file of MSH 2.2, text or binary, into nodes and tetrahedra.
/// Errors: MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<GmshFile> ParseGmsh(const std::string& bytes);

}  // namespace carillon::precompute
