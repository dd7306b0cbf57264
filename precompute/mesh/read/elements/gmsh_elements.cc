// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/gmsh_elements.h"

#include <algorithm>
#include <cstdlib>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace carillon::precompute {
namespace {

constexpr int kTriangle3 = 2, kTriangle6 = 9, kTetrahedron10 = 11;

constexpr std::array<GmshKind, 10> kGmshKinds = {{{15, 0, 1, 1},
                                                  {1, 1, 2, 2},
                                                  {8, 1, 3, 2},
                                                  {kTriangle3, 2, 3, 3},
                                                  {kTriangle6, 2, 6, 3},
                                                  {3, 2, 4, 4},
                                                  {10, 2, 9, 4},
                                                  {16, 2, 8, 4},
                                                  {4, 3, 4, 4},
                                                  {kTetrahedron10, 3, 10, 4}}};

/// A face as triangles, by the positions of their corners among its nodes.
std::span<const std::array<size_t, 3>> Pieces(int type) {
  static constexpr std::array<std::array<size_t, 3>, 1> kWhole = {{{0, 1, 2}}};
  static constexpr std::array<std::array<size_t, 3>, 2> kInTwo = {{{0, 1, 2}, {0, 2, 3}}};
  if (type == kTriangle3) return kWhole;
  if (type == kTriangle6) return kFaceInFour;
  return kInTwo;
}

}  // namespace

const GmshKind* FindGmshKind(int type) {
  const auto* kind = std::ranges::find(kGmshKinds, type, &GmshKind::type);
  return kind == kGmshKinds.end() ? nullptr : kind;
}

absl::Status UnknownGmshKind(int type) {
  return UnsupportedElements(absl::StrCat("an element of Gmsh's type ", type));
}

absl::Status GmshElements::Add(const GmshKind& kind, std::span<const int32_t> physicals,
                               std::span<const int64_t> nodes) {
  std::vector<std::string> groups;
  MeshRegion region;
  for (const int32_t physical : physicals) {
    const int32_t number = std::abs(physical);  // a sign is a direction
    const auto name = physical_names.find({kind.dimension, number});
    if (name != physical_names.end()) {
      groups.push_back(name->second);
      if (region.name.empty()) region.name = name->second;
    } else if (number != 0 && kind.dimension < 3) {
      groups.push_back(absl::StrCat(number));
    } else if (number != 0 && region.name.empty()) {
      region.name = absl::StrCat(number);
    }
  }
  file.AddToGroups(groups, nodes.first(kind.corner_count));
  const bool is_again = kind.type == last_type && std::ranges::equal(nodes, last_nodes);
  last_type = kind.type;
  last_nodes.assign(nodes.begin(), nodes.end());
  if (is_again) {
    const size_t pieces = kind.dimension == 2 ? Pieces(kind.type).size() : 0;
    for (const std::string& name : groups) {
      for (size_t t = file.triangles.size() - pieces; t < file.triangles.size(); ++t) {
        file.Named(name).triangles.push_back(static_cast<int32_t>(t));
      }
    }
    return absl::OkStatus();
  }
  if (kind.dimension == 2) {
    std::vector<std::array<int64_t, 3>> triangles;
    for (const auto& [a, b, c] : Pieces(kind.type)) {
      triangles.push_back({nodes[a], nodes[b], nodes[c]});
    }
    file.AddTriangles(groups, triangles);
  }
  if (kind.dimension != 3) return absl::OkStatus();
  std::vector<int64_t> tetrahedron(nodes.begin(), nodes.end());
  // Gmsh puts the last two mid-side nodes on the edges 2-3 and 1-3.
  if (kind.type == kTetrahedron10) std::swap(tetrahedron[8], tetrahedron[9]);
  return file.AddTetrahedron(tetrahedron, region);
}

}  // namespace carillon::precompute
