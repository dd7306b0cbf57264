// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface/join_parts.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The changes that may be made to a surface before it is filled.
struct PreparationSettings {
  bool repair = false;  ///< whether to repair a surface that CheckSurface would refuse
  double wall_m = 0;    ///< if above zero, hollow out the body or thicken an open sheet
  /// Whether a surface with more triangles than its modes need may be remeshed with fewer.
  bool coarsen = false;
  size_t most_triangles = 0;  ///< if above zero, the limit for a remeshed surface
};

/// A surface ready to be filled.
struct PreparedSurface {
  SurfaceMesh surface;
  /// For each triangle, the given triangle that it lies on or that is nearest to it.
  std::vector<int32_t> given_triangle;
  std::vector<std::string> warnings;
  /// Estimated relative error of the modes' frequencies that the coarsening causes.
  double frequency_error = 0;
  /// The walls between the parts of a body of several regions, see JoinParts; else empty.
  std::vector<std::array<int32_t, 3>> walls = {};
  std::vector<BodyPart> parts = {};
};

/// Checks a surface. If the settings allow it, repairs a faulty surface in three steps. RepairSoup
/// comes first and keeps the shape. FillHoles, Unfold and Untangle (repair_locally.h) follow, each
/// only for the fault that it repairs. WrapSurface comes last, if faults remain and no hole is too
/// wide. Then makes the wall, and coarsens the surface. Errors: those of CheckSurface,
/// MESH_REPAIR_FAILED, MESH_WALL_IMPOSSIBLE.
absl::StatusOr<PreparedSurface> PrepareSurface(const SurfaceMesh& given,
                                               const PreparationSettings& settings);

/// Prepares a surface of several regions, of which the body is joined. Errors: those of JoinParts.
absl::StatusOr<PreparedSurface> PrepareParts(const SurfaceMesh& given,
                                             const std::vector<int32_t>& region_of_triangle,
                                             const std::vector<std::string>& names);

}  // namespace carillon::precompute
