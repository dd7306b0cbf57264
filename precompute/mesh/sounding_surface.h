// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The surface that sounds. Its vertices are the boundary nodes of the mesh, mid-side nodes
/// included.
struct SoundingSurface {
  /// For each vertex, its node in the mesh; ascending.
  std::vector<int32_t> nodes;
  /// Each triangle has three indices into `nodes`, counter-clockwise seen from outside. A six-node
  /// face is split into four triangles.
  std::vector<std::array<int32_t, 3>> triangles;
  /// For each triangle, the triangle of the given surface on which it lies.
  std::vector<int32_t> given_triangle;
};

SoundingSurface MakeSoundingSurface(const TetMesh& mesh);

}  // namespace carillon::precompute
