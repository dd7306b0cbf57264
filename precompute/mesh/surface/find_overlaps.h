// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns pairs of triangles that lie on each other except for rounding, at most `most` of them.
/// Such triangles form a fold within an oblique plane. Exact predicates find them beside, above or
/// below each other, depending on the last bits of their coordinates. Collapsed triangles are
/// ignored.
///
/// The smaller triangle, seen along the normal of the larger one, covers a part of the larger one.
/// The two overlap if this part is wider than a millionth of the surface's diagonal, and if the
/// smaller triangle is there no further from the plane of the larger one than 2^-24 of the diagonal
/// (the resolution of single precision) and a thousandth of the part's width. The walls of a thin
/// body are further apart.
std::vector<std::pair<int32_t, int32_t>> FindOverlaps(const SurfaceMesh& surface, size_t most);

}  // namespace carillon::precompute
