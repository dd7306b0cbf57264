// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// How coarse a surface is: the longest edge of its triangles, in the mean over their area. Errors
/// of frequencies go with a power of it. In the unit of the vertices.
double Grain(const SurfaceMesh& surface);

}  // namespace carillon::precompute
