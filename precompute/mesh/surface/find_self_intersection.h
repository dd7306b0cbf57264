// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A reason why a closed surface is not the boundary of a solid.
struct SurfaceDefect {
  enum class Kind {
    kFlatTriangle,     ///< `first` has its corners on one line
    kPinched,          ///< at a corner of `first` several fans of triangles meet
    kSelfIntersecting  ///< `first` and `second` meet in more than an edge or corner they share
  };
  Kind kind;
  int32_t first;
  int32_t second;
};

/// Returns the first defect of a closed, oriented surface whose edges have two triangles each. Uses
/// exact predicates. Collapsed triangles are ignored.
std::optional<SurfaceDefect> FindSelfIntersection(const SurfaceMesh& surface);

}  // namespace carillon::precompute
