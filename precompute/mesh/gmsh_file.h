// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/tet_file.h"

namespace carillon::precompute {

/// Splits a file of MSH 2.2, text or binary, into nodes, tetrahedra and physical groups: by their
/// names, or by their numbers where these have none and do not number volumes (whose numbers stand
/// for materials).
/// https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format-version-2-_0028Legacy_0029
/// Errors: MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<TetFile> ParseGmsh(const std::string& bytes);

}  // namespace carillon::precompute
