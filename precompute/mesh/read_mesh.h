// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Reads the mesh file at `path`.
///
/// `format`: "obj", "ply", "stl", "off" (a surface; polygons are split into triangles, otherwise
/// triangles keep their order and count; vertices at the same place become one) or "msh" (Gmsh MSH
/// 2.2 of 4- or 10-node tetrahedra; the boundary is filled in).
/// `metres_per_unit`: length of one unit of the file.
///
/// Errors: MESH_FORMAT_UNKNOWN, MESH_FILE_NOT_READABLE, MESH_EMPTY, MESH_UNREADABLE,
/// MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED,
/// MESH_ZERO_VOLUME, MESH_SEVERAL_PIECES, MESH_NOT_MANIFOLD.
absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit);

}  // namespace carillon::precompute
