// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/reentrant_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

Point At(const TetMesh& mesh, int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; }

/// The normal of a boundary face, which points out of the body, of any length.
Point NormalOf(const TetMesh& mesh, const BoundaryFace& face) {
  const Point first = At(mesh, face.nodes[0]);
  return Cross(Difference(At(mesh, face.nodes[1]), first),
               Difference(At(mesh, face.nodes[2]), first));
}

/// The angle that two faces enclose within the body minus 180 degrees, in units of 90 degrees.
/// `opposite` is the corner of `second` that `first` does not have.
double Reentrance(const TetMesh& mesh, const BoundaryFace& first, const BoundaryFace& second,
                  int32_t opposite) {
  const Point normal = NormalOf(mesh, first);
  const Point other = NormalOf(mesh, second);
  const double angle = std::atan2(Norm(Cross(normal, other)), Dot(normal, other));
  const double rise = Dot(Difference(At(mesh, opposite), At(mesh, first.nodes[0])), normal);
  return (rise > 0 ? angle : -angle) / (std::numbers::pi / 2);
}

}  // namespace

std::vector<double> ReentrantNodes(const TetMesh& mesh) {
  std::vector<double> reentrance(mesh.nodes.size());
  absl::flat_hash_map<std::pair<int32_t, int32_t>, const BoundaryFace*> first_face;
  for (const BoundaryFace& face : mesh.boundary) {
    for (size_t i = 0; i < 3; ++i) {
      const int32_t a = face.nodes[i];
      const int32_t b = face.nodes[(i + 1) % 3];
      const auto [found, is_first] = first_face.try_emplace(std::minmax(a, b), &face);
      if (is_first) continue;
      const double here = Reentrance(mesh, *found->second, face, face.nodes[(i + 2) % 3]);
      for (const int32_t node : {a, b}) {
        double& largest = reentrance[static_cast<size_t>(node)];
        largest = std::max(largest, std::min(here, 1.0));
      }
    }
  }
  return reentrance;
}

}  // namespace carillon::precompute
