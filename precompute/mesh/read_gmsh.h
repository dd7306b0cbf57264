// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Reads the tetrahedra of a Gmsh file (MSH 2.2, text or binary), in the file's unit, boundary
/// included. Elements on points, lines and surfaces are passed over, and so are nodes that no
/// tetrahedron has; the others keep their order. Tetrahedra given mirrored are turned.
/// https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format-version-2-_0028Legacy_0029
///
/// Errors: MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_TOO_LARGE,
/// MESH_ELEMENT_UNSUPPORTED, MESH_EMPTY, MESH_ZERO_VOLUME, MESH_MIDSIDE_NODE_MISPLACED,
/// MESH_NOT_MANIFOLD, MESH_SEVERAL_PIECES.
absl::StatusOr<TetMesh> ReadGmsh(const std::string& bytes);

}  // namespace carillon::precompute
