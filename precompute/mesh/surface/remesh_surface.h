// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns the same surface in nearly regular triangles with edges of about `edge_m` (isotropic
/// remeshing, Botsch and Kobbelt 2004). Its vertices lie near the given surface, and it has no
/// slivers. Edges between faces whose normals differ by more than `sharp_degrees` stay where they
/// are. The result may cross itself where two parts of the surface are closer to each other than
/// the length of an edge.
///
/// Errors: that of the mesher, Internal.
absl::StatusOr<SurfaceMesh> RemeshSurface(const SurfaceMesh& given, double edge_m,
                                          double sharp_degrees);

}  // namespace carillon::precompute
