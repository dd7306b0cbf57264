// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Pairs of triangles that lie on each other except for rounding, at most `most` of them: a fold
/// within an oblique plane, whose triangles exact predicates find beside, above or below each
/// other, as the last bits of their coordinates have it. Collapsed triangles are ignored.
///
/// Two triangles overlap if the smaller one, seen along the normal of the larger one, covers a part
/// of it that is wider than a millionth of the surface's diagonal, and if that part is nowhere
/// further from the plane of the larger one than single precision resolves (2^-24 of the diagonal)
/// or than a thousandth of its width. The walls of a thin body are further apart.
std::vector<std::pair<int32_t, int32_t>> FindOverlaps(const SurfaceMesh& surface, size_t most);

}  // namespace carillon::precompute
