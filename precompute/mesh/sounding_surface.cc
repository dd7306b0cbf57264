// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/sounding_surface.h"

#include <cstddef>
#include <span>

namespace carillon::precompute {
namespace {

constexpr std::array<std::array<size_t, 3>, 1> kWhole = {{{0, 1, 2}}};

std::span<const std::array<size_t, 3>> Pieces(const TetMesh& mesh) {
  if (mesh.nodes_per_element == 10) return kFaceInFour;
  return kWhole;
}

/// Vertex of each boundary node, in the order of the nodes; -1 for a node inside.
std::vector<int32_t> NumberVertices(const TetMesh& mesh, std::vector<int32_t>& nodes) {
  std::vector<int32_t> vertex_of_node(mesh.nodes.size(), -1);
  for (const BoundaryFace& face : mesh.boundary) {
    for (const int32_t node : face.nodes) {
      if (node >= 0) vertex_of_node[static_cast<size_t>(node)] = 0;
    }
  }
  for (size_t node = 0; node < vertex_of_node.size(); ++node) {
    if (vertex_of_node[node] < 0) continue;
    vertex_of_node[node] = static_cast<int32_t>(nodes.size());
    nodes.push_back(static_cast<int32_t>(node));
  }
  return vertex_of_node;
}

}  // namespace

SoundingSurface MakeSoundingSurface(const TetMesh& mesh) {
  SoundingSurface surface;
  const std::vector<int32_t> vertex_of_node = NumberVertices(mesh, surface.nodes);
  for (const BoundaryFace& face : mesh.boundary) {
    for (const auto& piece : Pieces(mesh)) {
      std::array<int32_t, 3>& triangle = surface.triangles.emplace_back();
      for (size_t i = 0; i < 3; ++i) {
        triangle[i] = vertex_of_node[static_cast<size_t>(face.nodes[piece[i]])];
      }
      surface.given_triangle.push_back(face.given_triangle);
    }
  }
  return surface;
}

}  // namespace carillon::precompute
