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

/// A named part of a mesh file.
struct MeshGroup {
  std::string name;
  /// Indices of given triangles, if the mesh is a surface.
  std::vector<int32_t> triangles = {};
  /// If the mesh consists of tetrahedra: the points, edges, faces and elements of the group. Each
  /// is given by the nodes at its corners, filled up with -1.
  std::vector<std::array<int32_t, 4>> simplices = {};
};

/// A named part of the volume, which may have a material of its own.
struct MeshRegion {
  std::string name;
  std::string material = {};  ///< the name of its material in the file, or empty
  bool operator==(const MeshRegion&) const = default;
};

/// The names and numbers by which a mesh file identifies parts of the body.
struct MeshNames {
  /// The position of each vertex, with the vertex's number as the key. Vertices of a surface are
  /// counted from 0 in the order of the file (STL has none); nodes of tetrahedra have the file's
  /// numbers.
  absl::flat_hash_map<int64_t, Point> vertices = {};
  std::vector<MeshGroup> groups = {};
  /// The regions of tetrahedra, in the order of TetMesh::regions, or of a surface; empty if the
  /// file names none.
  std::vector<MeshRegion> regions = {};
  std::vector<int32_t> triangle_regions = {};  ///< the region of each triangle of a surface
  /// The place in the file, metres, from which all positions of the mesh are counted. It is zero
  /// unless the body lies so far away that single precision would not resolve it.
  Point origin_m = {0, 0, 0};
};

/// The content of a mesh file, which is a surface still to be filled, or a mesh of tetrahedra ready
/// for use.
using Mesh = std::variant<SurfaceMesh, TetMesh>;

struct NamedMesh {
  Mesh mesh;
  MeshNames names = {};
  /// What the reader left out or changed, for the user.
  std::vector<std::string> warnings = {};

  std::vector<Point>& points() {
    auto* surface = std::get_if<SurfaceMesh>(&mesh);
    return surface != nullptr ? surface->vertices : std::get<TetMesh>(mesh).nodes;
  }
};

}  // namespace carillon::precompute
