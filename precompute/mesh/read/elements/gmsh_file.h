// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// Splits a file of MSH 2.2 or 4.1, text or binary, into nodes, triangles, tetrahedra and physical
/// groups, see GmshElements.
/// https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format-version-2-_0028Legacy_0029
/// Errors: MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> ParseGmsh(const std::string& bytes);

}  // namespace carillon::precompute
