// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace carillon::precompute {

/// Refuses files whose faults assimp would silently clamp, repair or read past the end of. Returns
/// the file reduced to its surface, because assimp groups the faces of an OBJ file by its objects
/// and does not accept comments in OFF.
///
/// `format` is "obj", "off", "ply", "glb", "stl" or "gltf". Files of the last two formats are
/// returned unchanged, because assimp hides none of their faults.
/// Errors: MESH_UNREADABLE, MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, each with the line or byte;
/// MESH_EMPTY.
absl::StatusOr<std::string> CleanSurfaceFile(const std::string& bytes, const std::string& format);

/// Each of these functions handles one format.
absl::StatusOr<std::string> CleanObj(const std::string& bytes);
absl::StatusOr<std::string> CleanOff(const std::string& bytes);
absl::Status CheckPly(const std::string& bytes);
absl::Status CheckGlb(const std::string& bytes);

}  // namespace carillon::precompute
