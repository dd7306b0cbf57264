// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The same surface in nearly regular triangles with edges of about `edge_m` (isotropic remeshing,
/// Botsch and Kobbelt 2004), vertices near the given surface, slivers collapsed.
///
/// Errors: Internal RADIATION_REMESHING_FAILED.
absl::StatusOr<SurfaceMesh> RemeshSurface(const SurfaceMesh& given, double edge_m);

}  // namespace carillon::precompute
