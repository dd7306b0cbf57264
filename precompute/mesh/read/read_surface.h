// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Reads a surface, in the file's unit, and the names of its parts from the bytes of a file.
/// Coordinates are rounded to single precision, as files of triangles have them, so that corners
/// that were written with different digits are one. A body far from the origin is moved near it
/// first (FarOrigin).
///
/// `format`: "obj", "ply", "stl", "off", or "glb" or "gltf" with all data embedded in the file.
/// Errors: MESH_EMPTY, MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_TOO_LARGE.
absl::StatusOr<NamedMesh> ReadSurface(const std::string& bytes, const std::string& format);

}  // namespace carillon::precompute
