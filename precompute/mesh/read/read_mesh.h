// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Returns the bytes of a mesh file. For TetGen's pair of files it returns the .node file followed
/// by the .ele file, whichever of them is named, unless one file contains both already. Errors:
/// MESH_FILE_NOT_READABLE, MESH_EMPTY.
absl::StatusOr<std::string> ReadMeshFile(const std::string& path, const std::string& format);

/// Parses the bytes that ReadMeshFile returned into a mesh with the names of its parts.
///
/// `format`: "obj", "ply", "stl", "off", "glb", "gltf" (a surface; polygons are split into
/// triangles, otherwise triangles keep their order and count; vertices at the same place become
/// one), "msh" (Gmsh MSH 2.2 or 4.1), "mesh" (Medit, text), "node" (TetGen's .node and .ele) or
/// "inp" (Abaqus, CalculiX): 4- or 10-node tetrahedra, whose boundary is filled in, or without any
/// the triangles as a surface. `metres_per_unit`: length of one unit of the file.
///
/// Errors: MESH_FORMAT_UNKNOWN, MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE,
/// MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED, MESH_ZERO_VOLUME, MESH_MIDSIDE_NODE_MISPLACED,
/// MESH_SEVERAL_PIECES, MESH_NOT_MANIFOLD.
absl::StatusOr<NamedMesh> ParseMesh(const std::string& bytes, const std::string& format,
                                    double metres_per_unit);

/// ReadMeshFile, then ParseMesh.
absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit);

}  // namespace carillon::precompute
