// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/boundary.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
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

/// Returns the sorted corners of all faces, four for each element.
std::vector<Corners> FacesOf(const TetMesh& mesh) {
  std::vector<Corners> faces;
  faces.reserve(4 * mesh.element_count());
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* const element = &mesh.elements[e * stride];
    for (const auto& [a, b, c] : kTetFaces) {
      faces.push_back(Sorted({element[a], element[b], element[c]}));
    }
  }
  return faces;
}

/// Returns how many elements have each of the faces. The faces of each smallest node are sorted by
/// themselves, because few faces share it.
std::vector<uint32_t> CountUses(const std::vector<Corners>& faces, size_t node_count) {
  std::vector<size_t> begin(node_count + 1);
  for (const Corners& face : faces) ++begin[static_cast<size_t>(face[0]) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<size_t> next = begin;
  std::vector<uint32_t> order(faces.size());
  for (size_t f = 0; f < faces.size(); ++f) {
    order[next[static_cast<size_t>(faces[f][0])]++] = static_cast<uint32_t>(f);
  }
  std::vector<uint32_t> uses(faces.size());
  for (size_t node = 0; node < node_count; ++node) {
    const auto end = order.begin() + static_cast<ptrdiff_t>(begin[node + 1]);
    auto first = order.begin() + static_cast<ptrdiff_t>(begin[node]);
    std::sort(first, end, [&](uint32_t f, uint32_t g) { return faces[f] < faces[g]; });
    while (first != end) {
      const auto last =
          std::find_if(first, end, [&](uint32_t f) { return faces[f] != faces[*first]; });
      std::for_each(first, last,
                    [&](uint32_t f) { uses[f] = static_cast<uint32_t>(last - first); });
      first = last;
    }
  }
  return uses;
}

}  // namespace

absl::Status FindBoundary(TetMesh& mesh) {
  const std::vector<Corners> faces = FacesOf(mesh);
  const std::vector<uint32_t> uses = CountUses(faces, mesh.nodes.size());
  mesh.boundary.clear();
  for (size_t f = 0; f < faces.size(); ++f) {
    if (uses[f] > 2) {
      return Refusal(
          absl::StatusCode::kInvalidArgument, "MESH_NOT_MANIFOLD",
          absl::StrCat("more than two tetrahedra share the face of nodes ", faces[f][0], ", ",
                       faces[f][1], ", ", faces[f][2], ": remove tetrahedra that are there twice"));
    }
    if (uses[f] != 1) continue;
    mesh.boundary.push_back(FaceOf(mesh, f / 4, kTetFaces[f % 4]));
    mesh.boundary.back().given_triangle = static_cast<int32_t>(mesh.boundary.size()) - 1;
  }
  return absl::OkStatus();
}

SurfaceMesh PartOf(const std::vector<Point>& vertices, std::vector<Corners> triangles) {
  SurfaceMesh part{{}, std::move(triangles)};
  absl::flat_hash_map<int32_t, int32_t> number;
  for (Corners& triangle : part.triangles) {
    for (int32_t& v : triangle) {
      const auto [found, is_new] =
          number.try_emplace(v, static_cast<int32_t>(part.vertices.size()));
      if (is_new) part.vertices.push_back(vertices[static_cast<size_t>(v)]);
      v = found->second;
    }
  }
  return part;
}

SurfaceMesh BoundarySurface(const TetMesh& mesh) {
  std::vector<Corners> triangles;
  triangles.reserve(mesh.boundary.size());
  for (const BoundaryFace& face : mesh.boundary) {
    triangles.push_back({face.nodes[0], face.nodes[1], face.nodes[2]});
  }
  return PartOf(mesh.nodes, std::move(triangles));
}

}  // namespace carillon::precompute
