// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Reads a surface from the bytes of a file, in the file's unit, and what it calls its parts.
/// Coordinates have the 24 bits of assimp's numbers.
///
/// `format`: "obj", "ply", "stl" or "off".
/// Errors: MESH_EMPTY, MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE.
absl::StatusOr<NamedMesh> ReadSurface(const std::string& bytes, const std::string& format);

}  // namespace carillon::precompute
