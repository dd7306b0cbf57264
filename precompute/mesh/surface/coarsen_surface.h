// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// A surface of at most this many triangles is coarsened only if they are very narrow.
inline constexpr size_t kMaxUncoarsenedTriangles = 20'000;

/// Where the triangles of a surface come from.
enum class TriangleOrigin {
  kGiven,  ///< whoever made the surface may have chosen them for its modes
  kWrap,   ///< WrapSurface, whose triangles have one size and say nothing about the body
};

struct CoarsenedSurface {
  SurfaceMesh surface;
  std::string remark;  ///< describes the change
  /// Estimated relative error of the modes' frequencies that the change causes. It is the root mean
  /// square of the distance between both surfaces divided by the local thickness of the body.
  double frequency_error = 0;
};

/// Makes the edges of a surface longer if it has more triangles than its modes need. The edges are
/// half as long as those into which a surface of few triangles is divided, but the result has at
/// most `most_triangles` triangles if that number is above zero. The edges become shorter until the
/// surface moves by at most a hundredth of the body's thickness at that place (root mean square),
/// and at most by half of it anywhere. The result passes CheckSurface.
///
/// A wrap gets edges as long as a surface of few triangles, so that a repaired body costs about as
/// much as a sound one.
///
/// A given surface of narrow triangles gets such edges, too, if a mesh would divide it into six
/// times the triangles that the mesh needs.
///
/// Returns nothing if a given surface has at most kMaxUncoarsenedTriangles triangles, none of which
/// is so narrow, or if no surface with two thirds of its triangles keeps these limits. `surface`
/// must pass CheckSurface.
std::optional<CoarsenedSurface> CoarsenSurface(const SurfaceMesh& surface, size_t most_triangles,
                                               TriangleOrigin origin = TriangleOrigin::kGiven);

}  // namespace carillon::precompute
