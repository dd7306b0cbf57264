// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/element_file.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "precompute/mesh/mesh_limits.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {

ElementFile::Group& ElementFile::Named(const std::string& name) {
  const auto group = std::ranges::find(groups, name, &Group::name);
  if (group != groups.end()) return *group;
  return groups.emplace_back(Group{.name = name, .simplices = {}, .triangles = {}});
}

void ElementFile::AddToGroups(std::span<const std::string> names,
                              std::span<const int64_t> corners) {
  for (const std::string& name : names) {
    auto& simplex = Named(name).simplices.emplace_back();
    simplex.fill(kNoNode);
    std::ranges::copy(corners, simplex.begin());
  }
}

void ElementFile::AddTriangles(std::span<const std::string> names,
                               std::span<const std::array<int64_t, 3>> pieces) {
  for (const auto& piece : pieces) {
    for (const std::string& name : names) {
      Named(name).triangles.push_back(static_cast<int32_t>(triangles.size()));
    }
    triangles.push_back(piece);
  }
}

absl::Status ElementFile::AddTetrahedron(std::span<const int64_t> nodes_of_one,
                                         const MeshRegion& region) {
  const auto count = static_cast<int>(nodes_of_one.size());
  if (nodes_per_element != 0 && nodes_per_element != count) {
    return UnsupportedElements("tetrahedra of 4 and of 10 nodes");
  }
  nodes_per_element = count;
  elements.insert(elements.end(), nodes_of_one.begin(), nodes_of_one.end());
  // Neighbours in the file mostly have the same region.
  const bool is_last =
      !element_regions.empty() && regions[static_cast<size_t>(element_regions.back())] == region;
  const auto found =
      is_last ? regions.begin() + element_regions.back() : std::ranges::find(regions, region);
  element_regions.push_back(static_cast<int32_t>(found - regions.begin()));
  if (found == regions.end()) regions.push_back(region);
  return absl::OkStatus();
}

absl::Status CheckNodeCountOfFile(size_t count) {
  if (count <= static_cast<size_t>(kMaxMeshNodes)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                 absl::StrCat("the mesh has ", count, " nodes; the limit is ", kMaxMeshNodes,
                              ": give a coarser mesh"));
}

absl::Status UnsupportedElements(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_ELEMENT_UNSUPPORTED",
                 absl::StrCat("the file has ", what,
                              ": mesh the volume with tetrahedra of 4 or of 10 nodes alone"));
}

}  // namespace carillon::precompute
