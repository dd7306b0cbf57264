// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/mesh/size_field.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns the element size of a surface, in the unit of the vertices: the longest edge of each
/// triangle, divided by the relative size at its centroid, averaged over the area. Frequency errors
/// are proportional to a power of the element size.
double SurfaceElementSize(const SurfaceMesh& surface, const SizeField& relative_size = {});

}  // namespace carillon::precompute
