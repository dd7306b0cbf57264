// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// A part of a body that its file names.
struct MeshGroup {
  std::string name;
  /// Of a surface: its triangles, as given.
  std::vector<int32_t> triangles = {};
  /// Of tetrahedra: its points, edges, faces and elements, each by the nodes at its corners; -1
  /// past the last.
  std::vector<std::array<int32_t, 4>> simplices = {};
};

/// By what a mesh file and its user call parts of the body.
struct MeshNames {
  /// Place of each vertex, by its number: of a surface from 0 in the order of the file (STL has
  /// none), of tetrahedra as the file numbers its nodes.
  absl::flat_hash_map<int64_t, Point> vertices = {};
  std::vector<MeshGroup> groups = {};
};

/// What a mesh file holds: a surface still to be filled, or a mesh of tetrahedra ready for use.
using Mesh = std::variant<SurfaceMesh, TetMesh>;

struct NamedMesh {
  Mesh mesh;
  MeshNames names = {};
};

}  // namespace carillon::precompute
