// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns at most `most` pairs of triangles that coincide except for rounding. Such triangles form
/// a fold within an oblique plane. Exact predicates cannot detect a fold reliably, because their
/// result depends on the last bits of the coordinates. Collapsed triangles are ignored.
///
/// The smaller triangle, seen along the normal of the larger one, covers a part of the larger one.
/// The two triangles overlap if this part is wider than a millionth of the surface's diagonal, and
/// if the smaller triangle is close to the plane of the larger one there. Close means nearer than
/// both 2^-24 of the diagonal (the resolution of single precision) and a thousandth of the part's
/// width. The walls of a thin body are further apart.
std::vector<std::pair<int32_t, int32_t>> FindOverlaps(const SurfaceMesh& surface, size_t most);

}  // namespace carillon::precompute
