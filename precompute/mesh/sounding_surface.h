// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The surface that sounds: the boundary nodes of the mesh, mid-sides included.
struct SoundingSurface {
  /// Node of the mesh for each vertex, ascending.
  std::vector<int32_t> nodes;
  /// Three indices into `nodes` each, counter-clockwise seen from outside; a six-node face gives
  /// four.
  std::vector<std::array<int32_t, 3>> triangles;
  /// For each triangle the triangle of the surface as given on which it lies.
  std::vector<int32_t> given_triangle;
};

SoundingSurface MakeSoundingSurface(const TetMesh& mesh);

}  // namespace carillon::precompute
