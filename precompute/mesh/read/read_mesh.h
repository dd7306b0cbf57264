// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Parses the bytes that ReadMeshFile returned into a mesh with the names of its parts.
///
/// The formats "obj", "ply", "stl", "off", "glb" and "gltf" give a surface. Polygons are split into
/// triangles, the order and number of triangles stay the same otherwise, and vertices with the same
/// position become one. The formats "msh" (Gmsh MSH 2.2 or 4.1), "mesh" (Medit, text), "node"
/// (TetGen's .node and .ele) and "inp" (Abaqus, CalculiX) give 4- or 10-node tetrahedra with their
/// boundary. A file without tetrahedra gives its triangles as a surface. `metres_per_unit` is the
/// length of one unit of the file.
///
/// Errors: MESH_FORMAT_UNKNOWN, MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE,
/// MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED, MESH_ZERO_VOLUME, MESH_ELEMENT_INVERTED,
/// MESH_SEVERAL_PIECES, MESH_NOT_MANIFOLD.
///
/// A new format is added to kMeshFormats (proto/cpp/mesh_format.h) and, if its files have elements,
/// to ParseElements in read_mesh.cc; CONTRIBUTING.md names all files.
absl::StatusOr<NamedMesh> ParseMesh(const std::string& bytes, const std::string& format,
                                    double metres_per_unit);

/// Calls ReadMeshFile and then ParseMesh.
absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit);

}  // namespace carillon::precompute
