// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Returns the groups and objects ("g", "o") of an OBJ file that CleanObj accepts, with their
/// triangles as ReadSurface numbers them. A group and an object with the same name become one
/// group.
std::vector<MeshGroup> ObjGroups(const std::string& bytes);

}  // namespace carillon::precompute
