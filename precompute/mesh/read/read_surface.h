// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Reads a surface, in the file's unit, and the names of its parts from the bytes of a file.
/// Coordinates have single precision, because assimp uses it.
///
/// `format`: "obj", "ply", "stl", "off", or "glb" or "gltf" with all data embedded in the file.
/// Errors: MESH_EMPTY, MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE.
absl::StatusOr<NamedMesh> ReadSurface(const std::string& bytes, const std::string& format);

}  // namespace carillon::precompute
