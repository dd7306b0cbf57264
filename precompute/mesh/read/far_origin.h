// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "precompute/mesh/mesh_names.h"

namespace carillon::precompute {

/// Returns the place from which to count the coordinates of points so that single precision, in
/// which models are stored, resolves the body: the origin, unless a coordinate is more than 256
/// times as large as the body's diagonal; then round figures below the least coordinates. `points`
/// must not be empty.
Point FarOrigin(const std::vector<Point>& points);

/// Moves all positions of the mesh so that they count from `origin`.
void CountFrom(const Point& origin, NamedMesh& named);

}  // namespace carillon::precompute
