// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The element size of a surface: the longest edge of each triangle, averaged over the area, in the
/// unit of the vertices. Frequency errors are proportional to a power of it.
double SurfaceElementSize(const SurfaceMesh& surface);

}  // namespace carillon::precompute
