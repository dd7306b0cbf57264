// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A surface made sound, and in words what was done to it.
struct MendedSurface {
  SurfaceMesh surface;
  std::vector<std::string> remarks;
};

/// Mends what can be mended without changing the shape: joins vertices that lie within a millionth
/// of the diagonal, drops triangles without extent and those that lie on others, closes
/// the seams and T-junctions that this leaves and holes with a rim shorter than a fifth of the
/// diagonal, turns triangles so that they agree and bound a
/// volume. The result may still have faults; CheckSurface says.
MendedSurface MendSoup(const SurfaceMesh& given);

}  // namespace carillon::precompute
