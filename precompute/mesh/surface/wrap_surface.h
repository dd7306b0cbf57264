// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Wraps a soup of triangles with a closed surface (Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner
/// and Alliez, Alpha wrapping with an offset, SIGGRAPH 2022): closes gaps and holes narrower than a
/// hundredth of the diagonal of the box around it, unites parts that overlap, drops what is inside.
/// The remark states the greatest distance between the two surfaces in both directions.
///
/// Errors: MESH_NOT_CLOSED where nothing is inside (an open sheet), MESH_REPAIR_FAILED.
absl::StatusOr<RepairedSurface> WrapSurface(const SurfaceMesh& given);

}  // namespace carillon::precompute
