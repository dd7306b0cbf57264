// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// Splits an input file of Abaqus or CalculiX (.inp, one part) into nodes, triangles and tetrahedra
/// of first or second order. Its groups are the sets of nodes and of elements (NSET, ELSET), which
/// keep the spelling of their first mention. Everything else in the file is ignored. Errors:
/// MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> ParseInp(const std::string& bytes);

}  // namespace carillon::precompute
