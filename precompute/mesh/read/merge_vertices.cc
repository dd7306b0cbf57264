// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/merge_vertices.h"

#include <cstddef>
#include <cstdint>

#include "absl/container/flat_hash_map.h"

namespace carillon::precompute {

SurfaceMesh MergeVertices(const std::vector<std::array<Point, 3>>& triangles) {
  SurfaceMesh surface;
  surface.triangles.reserve(triangles.size());
  absl::flat_hash_map<Point, int32_t> vertex_at;  // equal and equally hashed for -0.0 and 0.0
  for (const auto& corners : triangles) {
    auto& triangle = surface.triangles.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      const auto [found, is_new] =
          vertex_at.try_emplace(corners[i], static_cast<int32_t>(surface.vertices.size()));
      if (is_new) surface.vertices.push_back(corners[i]);
      triangle[i] = found->second;
    }
  }
  return surface;
}

}  // namespace carillon::precompute
