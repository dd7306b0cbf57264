// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// What may be changed of a surface before it is filled.
struct PreparationSettings {
  bool repair = false;  ///< mend what CheckSurface would refuse
  double wall_m = 0;    ///< above zero: hollow it out, or thicken an open sheet
};

/// A surface ready to be filled.
struct PreparedSurface {
  SurfaceMesh surface;
  /// For each triangle that of the surface as given on which it lies, or which is nearest.
  std::vector<int32_t> given_triangle;
  std::vector<std::string> warnings;
};

/// Checks a surface and, where the settings allow, mends it: gently first, then by wrapping it.
/// Then gives it its wall. Errors: those of CheckSurface, MESH_REPAIR_FAILED, MESH_WALL_IMPOSSIBLE.
absl::StatusOr<PreparedSurface> PrepareSurface(const SurfaceMesh& given,
                                               const PreparationSettings& settings);

}  // namespace carillon::precompute
