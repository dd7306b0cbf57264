// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/make_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/read/merge_vertices.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

absl::Status Refuse(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

absl::Status CheckFinite(const ElementFile& file) {
  for (size_t n = 0; n < file.nodes.size(); ++n) {
    const Point& p = file.nodes[n];
    if (std::ranges::all_of(p, [](double x) { return std::isfinite(x); })) continue;
    return Refuse("MESH_NOT_FINITE",
                  absl::StrCat("node ", file.node_numbers[n], " lies at (", p[0], ", ", p[1], ", ",
                               p[2], "): give it finite coordinates"));
  }
  return absl::OkStatus();
}

using NodeOfNumber = absl::flat_hash_map<int64_t, int32_t>;

absl::StatusOr<NodeOfNumber> NumberNodes(const ElementFile& file) {
  NodeOfNumber node_of_number;
  for (size_t n = 0; n < file.node_numbers.size(); ++n) {
    const auto [found, is_new] =
        node_of_number.try_emplace(file.node_numbers[n], static_cast<int32_t>(n));
    if (is_new || file.nodes[static_cast<size_t>(found->second)] == file.nodes[n]) continue;
    return Refuse("MESH_UNREADABLE",
                  absl::StrCat("the file has node ", file.node_numbers[n],
                               " twice, at different places: number nodes once"));
  }
  return node_of_number;
}

/// Warns of faces beside the tetrahedra, such as a shell that is attached to them: they are no part
/// of the body.
void WarnOfOtherFaces(ElementFile& file) {
  const absl::flat_hash_set<int64_t> of_tetrahedra(file.elements.begin(), file.elements.end());
  const auto is_other = [&](const std::array<int64_t, 3>& triangle) {
    return std::ranges::any_of(triangle, [&](int64_t n) { return !of_tetrahedra.contains(n); });
  };
  const auto count = std::ranges::count_if(file.triangles, is_other);
  if (count == 0) return;
  file.warnings.push_back(absl::StrCat(count,
                                       " triangles of the file have nodes that belong to no "
                                       "tetrahedron, and were left out"));
}

/// The nodes of elements, as indices into `file.nodes`.
absl::StatusOr<std::vector<int32_t>> FindNodes(std::span<const int64_t> numbers, size_t of_each,
                                               absl::string_view element,
                                               const NodeOfNumber& node_of_number) {
  std::vector<int32_t> nodes;
  nodes.reserve(numbers.size());
  for (const int64_t number : numbers) {
    const auto found = node_of_number.find(number);
    if (found == node_of_number.end()) {
      return Refuse(
          "MESH_INDEX_OUT_OF_RANGE",
          absl::StrCat(element, " ", nodes.size() / of_each, " (counted from zero) names node ",
                       number, ", which the file does not have: export the mesh again"));
    }
    nodes.push_back(found->second);
  }
  return nodes;
}

/// Drops the nodes that belong to no element. Returns the new index of each node, -1 for a dropped
/// one.
std::vector<int32_t> DropUnusedNodes(TetMesh& mesh) {
  std::vector<int32_t> new_index(mesh.nodes.size(), -1);
  for (const int32_t node : mesh.elements) new_index[static_cast<size_t>(node)] = 0;
  std::vector<Point> used;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (new_index[n] < 0) continue;
    new_index[n] = static_cast<int32_t>(used.size());
    used.push_back(mesh.nodes[n]);
  }
  for (int32_t& node : mesh.elements) node = new_index[static_cast<size_t>(node)];
  mesh.nodes = std::move(used);
  return new_index;
}

/// The names of the remaining nodes. A simplex with a dropped node is ignored.
MeshNames NamesOf(const ElementFile& file, const NodeOfNumber& node_of_number,
                  const std::vector<int32_t>& new_index, const TetMesh& mesh) {
  const auto index_of = [&](int64_t number) {
    const auto found = node_of_number.find(number);
    return found == node_of_number.end() ? -1 : new_index[static_cast<size_t>(found->second)];
  };
  MeshNames names;
  for (const int64_t number : file.node_numbers) {
    const int32_t node = index_of(number);
    if (node >= 0) names.vertices[number] = mesh.nodes[static_cast<size_t>(node)];
  }
  for (const ElementFile::Group& group : file.groups) {
    MeshGroup& named = names.groups.emplace_back(MeshGroup{.name = group.name});
    for (const auto& numbers : group.simplices) {
      std::array<int32_t, 4> corners = {-1, -1, -1, -1};
      size_t count = 0;
      while (count < 4 && numbers[count] != ElementFile::kNoNode) ++count;
      std::transform(numbers.begin(), numbers.begin() + count, corners.begin(), index_of);
      const auto end = corners.begin() + count;
      if (std::find(corners.begin(), end, -1) == end) named.simplices.push_back(corners);
    }
  }
  return names;
}

/// Swaps corners 0 and 1, and with them their mid-side nodes.
void TurnRound(int32_t* element, int nodes_per_element) {
  std::swap(element[0], element[1]);
  if (nodes_per_element == 4) return;
  std::swap(element[5], element[6]);
  std::swap(element[7], element[8]);
}

/// Volume of a tetrahedron, as a part of the cube over its longest edge, below which it is flat.
constexpr double kMinVolumePart = 1e-12;

absl::Status OrientElements(TetMesh& mesh) {
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    int32_t* element = &mesh.elements[e * stride];
    const auto at = [&](int i) { return mesh.nodes[static_cast<size_t>(element[i])]; };
    const double volume = TetVolume(at(0), at(1), at(2), at(3));
    double longest = 0;
    for (const auto& [i, j] : kTetEdges) longest = std::max(longest, Distance(at(i), at(j)));
    if (std::abs(volume) <= kMinVolumePart * longest * longest * longest) {
      return Refuse(
          "MESH_ZERO_VOLUME",
          absl::StrCat("tetrahedron ", e, " (counted from zero) near (", at(0)[0], ", ", at(0)[1],
                       ", ", at(0)[2], ") is flat: let the mesher optimise the mesh"));
    }
    if (volume < 0) TurnRound(element, mesh.nodes_per_element);
  }
  return absl::OkStatus();
}

/// The largest distance of a mid-side node from the middle of its edge, in lengths of the edge. An
/// edge along a third of a circle has 0.29.
constexpr double kMostCurved = 0.35;

/// In another order of the nodes a mid-side node would be a whole edge away from its place.
absl::Status CheckMidsideNodes(const TetMesh& mesh) {
  if (mesh.nodes_per_element != 10) return absl::OkStatus();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const auto at = [&](size_t i) {
      return mesh.nodes[static_cast<size_t>(mesh.elements[e * 10 + i])];
    };
    for (size_t edge = 0; edge < kTetEdges.size(); ++edge) {
      const Point a = at(static_cast<size_t>(kTetEdges[edge][0]));
      const Point b = at(static_cast<size_t>(kTetEdges[edge][1]));
      const Point middle = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
      if (Distance(at(4 + edge), middle) < kMostCurved * Distance(a, b)) continue;
      return Refuse(
          "MESH_ELEMENT_INVERTED",
          absl::StrCat("tetrahedron ", e,
                       " (counted from zero) has a mid-side node more "
                       "than 0.35 of its edge from the middle, near (",
                       middle[0], ", ", middle[1], ", ", middle[2],
                       "): write the nodes in the order of the format, or curve elements less"));
    }
  }
  return absl::OkStatus();
}

/// Every element must be reached from the first through faces.
absl::Status CheckOnePiece(const TetMesh& mesh) {
  using Corners = std::array<int32_t, 3>;
  const auto face_of = [&](size_t e, size_t face) {
    Corners corners;
    for (size_t i = 0; i < 3; ++i) {
      corners[i] = mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element) +
                                 static_cast<size_t>(kTetFaces[face][i])];
    }
    std::ranges::sort(corners);
    return corners;
  };
  absl::flat_hash_map<Corners, std::array<size_t, 2>> elements_of_face;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t face = 0; face < 4; ++face) {
      elements_of_face.try_emplace(face_of(e, face), std::array{e, e}).first->second[1] = e;
    }
  }
  std::vector<bool> reached(mesh.element_count());
  std::vector<size_t> next = {0};
  reached[0] = true;
  size_t count = 0;
  while (!next.empty()) {
    const size_t e = next.back();
    next.pop_back();
    ++count;
    for (size_t face = 0; face < 4; ++face) {
      for (const size_t neighbour : elements_of_face.at(face_of(e, face))) {
        if (reached[neighbour]) continue;
        reached[neighbour] = true;
        next.push_back(neighbour);
      }
    }
  }
  if (count == mesh.element_count()) return absl::OkStatus();
  return Refuse(
      "MESH_SEVERAL_PIECES",
      absl::StrCat("only ", count, " of ", mesh.element_count(),
                   " tetrahedra hang together by their faces: join the pieces (merge nodes "
                   "at the same place), or submit each as a mesh of its own"));
}

absl::StatusOr<NamedMesh> MakeTetrahedra(ElementFile& file, const NodeOfNumber& node_of_number) {
  ASSIGN_OR_RETURN(std::vector<int32_t> elements,
                   FindNodes(file.elements, static_cast<size_t>(file.nodes_per_element),
                             "tetrahedron", node_of_number));
  WarnOfOtherFaces(file);
  TetMesh mesh{std::move(file.nodes), file.nodes_per_element, std::move(elements), {}};
  mesh.regions = std::move(file.element_regions);
  const std::vector<int32_t> new_index = DropUnusedNodes(mesh);
  RETURN_IF_ERROR(OrientElements(mesh));
  for (const auto check : {CheckMidsideNodes, CheckOnePiece}) {
    RETURN_IF_ERROR(check(mesh));
  }
  RETURN_IF_ERROR(FindBoundary(mesh));
  MeshNames names = NamesOf(file, node_of_number, new_index, mesh);
  names.regions = std::move(file.regions);
  return NamedMesh{std::move(mesh), std::move(names), std::move(file.warnings)};
}

/// A file of triangles alone, whose groups are of triangles, too.
absl::StatusOr<NamedMesh> MakeSurface(const ElementFile& file, const NodeOfNumber& node_of_number) {
  const std::span<const int64_t> numbers(file.triangles.front().data(), 3 * file.triangles.size());
  ASSIGN_OR_RETURN(const std::vector<int32_t> nodes,
                   FindNodes(numbers, 3, "triangle", node_of_number));
  std::vector<std::array<Point, 3>> triangles(file.triangles.size());
  for (size_t i = 0; i < nodes.size(); ++i) {
    triangles[i / 3][i % 3] = file.nodes[static_cast<size_t>(nodes[i])];
  }
  NamedMesh named{.mesh = MergeVertices(triangles), .names = {}, .warnings = file.warnings};
  for (size_t n = 0; n < file.nodes.size(); ++n) {
    named.names.vertices[file.node_numbers[n]] = file.nodes[n];
  }
  for (const ElementFile::Group& group : file.groups) {
    named.names.groups.push_back({.name = group.name, .triangles = group.triangles});
  }
  return named;
}

}  // namespace

absl::StatusOr<NamedMesh> MakeMesh(ElementFile file) {
  RETURN_IF_ERROR(CheckFinite(file));
  ASSIGN_OR_RETURN(const NodeOfNumber node_of_number, NumberNodes(file));
  if (!file.elements.empty()) return MakeTetrahedra(file, node_of_number);
  if (!file.triangles.empty()) return MakeSurface(file, node_of_number);
  return Refuse(
      "MESH_EMPTY",
      "the file has neither tetrahedra nor triangles: mesh the volume (\"gmsh -3\") or its "
      "surface (\"gmsh -2\")");
}

}  // namespace carillon::precompute
