// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A repaired surface, and descriptions of the repairs.
struct RepairedSurface {
  SurfaceMesh surface;
  std::vector<std::string> remarks;
};

/// Repairs a surface without changing its shape: joins vertices that lie within a millionth of the
/// diagonal, drops triangles without area and duplicates, closes the seams and T-junctions that
/// this leaves, closes holes with a rim shorter than a fifth of the diagonal, and orients triangles
/// consistently and outward. The result may still have defects, which CheckSurface finds.
///
/// `join_m`: if above zero, corners of open edges that lie within this distance, m, are joined,
/// too.
RepairedSurface RepairSoup(const SurfaceMesh& given, double join_m = 0);

/// Returns the distance, m, within which corners of open edges are taken for one corner that was
/// written several times: a tenth of the shortest edge, but at most a thousandth of the diagonal.
double JoinDistance(const SurfaceMesh& given);

}  // namespace carillon::precompute
