// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// Splits a TetGen .node file followed by its .ele file into nodes and tetrahedra of 4 or 10 nodes,
/// numbered from 0 or from 1. The boundary marker of a node is the number of its group; zero means
/// no group. https://wias-berlin.de/software/tetgen/fformats.html Errors: MESH_UNREADABLE,
/// MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> ParseTetgen(const std::string& bytes);

}  // namespace carillon::precompute
