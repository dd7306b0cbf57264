// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// Splits a text file of Medit (.mesh) into nodes, triangles and tetrahedra of first or second
/// order. The reference of a triangle, edge or vertex is the number of its group; zero means no
/// group. A number that several kinds use denotes the triangles, or else the edges, because meshers
/// give vertices references of their own. Other sections (ridges, normals, ...) are ignored.
/// https://pages.saclay.inria.fr/pascal.frey/logiciels/Docmedit.pdf Errors: MESH_UNREADABLE,
/// MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> ParseMedit(const std::string& bytes);

}  // namespace carillon::precompute
