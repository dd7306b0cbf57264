// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/midside_nodes.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace carillon::precompute {
namespace {

/// One mid-side node for each edge, made when it is first asked for.
class MidsideNodes {
 public:
  explicit MidsideNodes(std::vector<Point>& nodes) : nodes_(nodes) {}

  int32_t Between(int32_t a, int32_t b) {
    const auto [found, is_new] =
        node_of_edge_.try_emplace(std::minmax(a, b), static_cast<int32_t>(nodes_.size()));
    if (is_new) {
      const Point& p = nodes_[static_cast<size_t>(a)];
      const Point& q = nodes_[static_cast<size_t>(b)];
      nodes_.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
    }
    return found->second;
  }

 private:
  std::vector<Point>& nodes_;
  absl::flat_hash_map<std::pair<int32_t, int32_t>, int32_t> node_of_edge_;
};

}  // namespace

void AddMidsideNodes(TetMesh& mesh) {
  assert(mesh.nodes_per_element == 4);
  MidsideNodes midsides(mesh.nodes);
  std::vector<int32_t> elements;
  elements.reserve(mesh.element_count() * 10);
  for (size_t e = 0; e < mesh.elements.size(); e += 4) {
    const int32_t* corner = &mesh.elements[e];
    elements.insert(elements.end(), corner, corner + 4);
    for (const auto& [i, j] : kTetEdges) elements.push_back(midsides.Between(corner[i], corner[j]));
  }
  for (BoundaryFace& face : mesh.boundary) {
    auto& n = face.nodes;
    for (size_t i = 0; i < 3; ++i) n[3 + i] = midsides.Between(n[i], n[(i + 1) % 3]);
  }
  mesh.elements = std::move(elements);
  mesh.nodes_per_element = 10;
}

}  // namespace carillon::precompute
