// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/read/element_file.h"

namespace carillon::precompute {

/// Splits a text file of Medit (.mesh) into nodes, triangles and tetrahedra of first or second
/// order. Groups are the references of triangles, edges and vertices; a number that several kinds
/// use is that of the triangles, else of the edges, because meshers give vertices references of
/// their own; zero is none. What else the file says (ridges, normals, ...) is passed over.
/// https://pages.saclay.inria.fr/pascal.frey/logiciels/Docmedit.pdf
/// Errors: MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> ParseMedit(const std::string& bytes);

}  // namespace carillon::precompute
