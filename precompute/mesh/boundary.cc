// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/boundary.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

using Corners = std::array<int32_t, 3>;

Corners Sorted(Corners corners) {
  std::ranges::sort(corners);
  return corners;
}

int32_t MidsideNode(const int32_t* element, int a, int b) {
  for (size_t edge = 0; edge < kTetEdges.size(); ++edge) {
    const auto& [i, j] = kTetEdges[edge];
    if ((i == a && j == b) || (i == b && j == a)) return element[4 + edge];
  }
  return -1;
}

BoundaryFace FaceOf(const TetMesh& mesh, size_t element_index, const std::array<int, 3>& corner) {
  const int32_t* element =
      &mesh.elements[element_index * static_cast<size_t>(mesh.nodes_per_element)];
  BoundaryFace face{{-1, -1, -1, -1, -1, -1}, -1};
  for (size_t i = 0; i < 3; ++i) {
    face.nodes[i] = element[corner[i]];
    if (mesh.nodes_per_element == 10) {
      face.nodes[3 + i] = MidsideNode(element, corner[i], corner[(i + 1) % 3]);
    }
  }
  return face;
}

Corners CornersOf(const BoundaryFace& face) {
  return {face.nodes[0], face.nodes[1], face.nodes[2]};
}

}  // namespace

absl::Status FindBoundary(TetMesh& mesh) {
  absl::flat_hash_map<Corners, int> use_count;
  use_count.reserve(mesh.element_count() * 2);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const auto& corner : kTetFaces) {
      const Corners corners = CornersOf(FaceOf(mesh, e, corner));
      if (++use_count[Sorted(corners)] > 2) {
        return Refusal(
            absl::StatusCode::kInvalidArgument, "MESH_NOT_MANIFOLD",
            absl::StrCat("more than two tetrahedra share the face of nodes ", corners[0], ", ",
                         corners[1], ", ", corners[2], ": remove tetrahedra that are there twice"));
      }
    }
  }
  mesh.boundary.clear();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const auto& corner : kTetFaces) {
      BoundaryFace face = FaceOf(mesh, e, corner);
      if (use_count[Sorted(CornersOf(face))] != 1) continue;
      face.given_triangle = static_cast<int32_t>(mesh.boundary.size());
      mesh.boundary.push_back(face);
    }
  }
  return absl::OkStatus();
}

SurfaceMesh BoundarySurface(const TetMesh& mesh) {
  SurfaceMesh surface;
  std::vector<int32_t> vertex_of_node(mesh.nodes.size(), -1);
  for (const BoundaryFace& face : mesh.boundary) {
    Corners triangle = CornersOf(face);
    for (int32_t& corner : triangle) {
      int32_t& vertex = vertex_of_node[static_cast<size_t>(corner)];
      if (vertex < 0) {
        vertex = static_cast<int32_t>(surface.vertices.size());
        surface.vertices.push_back(mesh.nodes[static_cast<size_t>(corner)]);
      }
      corner = vertex;
    }
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace carillon::precompute
