// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Holes narrower than this part of the diagonal are closed by a wrap.
inline constexpr double kWrappedHolePart = 1.0 / 100;

/// Wraps a soup of triangles with a closed surface (Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner
/// and Alliez, Alpha wrapping with an offset, SIGGRAPH 2022). This closes gaps and holes narrower
/// than a hundredth of the diagonal, unites parts that overlap, and drops enclosed triangles. The
/// remark states the greatest distance of each of the two surfaces from the other.
///
/// Errors: MESH_NOT_CLOSED if the result encloses no volume (an open sheet), MESH_REPAIR_FAILED.
absl::StatusOr<RepairedSurface> WrapSurface(const SurfaceMesh& given);

}  // namespace carillon::precompute
