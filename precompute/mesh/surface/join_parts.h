// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// A closed surface around a connected piece of one region.
struct BodyPart {
  SurfaceMesh surface;
  int32_t region = 0;
};

/// A body of several parts.
struct JoinedParts {
  SurfaceMesh outside;  ///< closed, and checked by CheckSurface
  /// The walls between two parts, as triangles of the vertices of `outside`.
  std::vector<std::array<int32_t, 3>> walls;
  std::vector<BodyPart> parts;
};

/// Joins the regions of a surface into a body. `region_of_triangle` has the region of each
/// triangle, and `names` how messages call the regions. A region may have several pieces. Where the
/// rim of a region is that of another, a wall is put between both. Where the walls of two pieces
/// lie on each other with different triangles, both get the same ones, exactly in the plane that
/// they share.
///
/// Errors: those of CheckSurface for a region, or for the body, which begin with the name of the
/// region, or say that the parts overlap or leave gaps.
absl::StatusOr<JoinedParts> JoinParts(const SurfaceMesh& surface,
                                      const std::vector<int32_t>& region_of_triangle,
                                      const std::vector<std::string>& names);

/// Turns the numbers in `mesh.regions`, one for each space that walls enclose, into those of the
/// regions of the parts.
void NameRegions(const std::vector<BodyPart>& parts, TetMesh& mesh);

}  // namespace carillon::precompute
