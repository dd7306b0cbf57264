// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// Checks the tetrahedra of a file and finds their boundary. If the file has no tetrahedra, makes a
/// surface from its triangles. Nodes that belong to no tetrahedron are dropped; the others keep
/// their order. Mirrored tetrahedra are reoriented.
///
/// Errors: MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_EMPTY, MESH_ZERO_VOLUME,
/// MESH_ELEMENT_INVERTED, MESH_NOT_MANIFOLD, MESH_SEVERAL_PIECES.
absl::StatusOr<NamedMesh> MakeMesh(ElementFile file);

}  // namespace carillon::precompute
