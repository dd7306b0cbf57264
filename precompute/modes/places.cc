// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/places.h"

#include <algorithm>

namespace carillon::precompute {
namespace {

/// Finds the number of a place by its corners. Places with the same least corner form a list, which
/// is short.
class Numbering {
 public:
  explicit Numbering(size_t node_count) : first_(node_count, -1) {}

  /// Returns the number of the place, the next one if it has none. `corners` ascend, with -1 at the
  /// end of an edge.
  int32_t NumberOf(const std::array<int32_t, 3>& corners) {
    int32_t& first = first_[static_cast<size_t>(corners[0])];
    for (int32_t n = first; n >= 0; n = next_[static_cast<size_t>(n)]) {
      if (places_[static_cast<size_t>(n)] == corners) return n;
    }
    const auto number = static_cast<int32_t>(places_.size());
    places_.push_back(corners);
    next_.push_back(first);
    return first = number;
  }

  std::vector<std::array<int32_t, 3>>& places() { return places_; }

 private:
  std::vector<int32_t> first_;  // the place found last with this least corner, or -1
  std::vector<int32_t> next_;   // the one found before it
  std::vector<std::array<int32_t, 3>> places_;
};

}  // namespace

Places::Places(const TetMesh& mesh) : of_element_(mesh.nodes_per_element == 10 ? 10 : 6) {
  Numbering numbering(mesh.nodes.size());
  number_.reserve(of_element_ * mesh.element_count());
  sign_.reserve(of_element_ * mesh.element_count());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* corners = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    for (const auto& [a, b] : kTetEdges) {
      const auto [least, greatest] = std::minmax(corners[a], corners[b]);
      number_.push_back(numbering.NumberOf({least, greatest, -1}));
      sign_.push_back(corners[a] < corners[b] ? 1 : -1);
    }
    if (of_element_ == 6) continue;
    for (const auto& [a, b, c] : kTetFaces) {
      std::array<int32_t, 3> face = {corners[a], corners[b], corners[c]};
      std::ranges::sort(face);
      number_.push_back(numbering.NumberOf(face));
      sign_.push_back(1);
    }
  }
  corners_ = std::move(numbering.places());
}

std::vector<bool> Places::FixedWith(const TetMesh& mesh) const {
  std::vector<bool> node_is_fixed(mesh.nodes.size());
  for (const int32_t node : mesh.fixed) node_is_fixed[static_cast<size_t>(node)] = true;
  std::vector<bool> fixed;
  fixed.reserve(count());
  for (const auto& corners : corners_) {
    fixed.push_back(std::ranges::all_of(corners, [&](int32_t node) {
      return node < 0 || node_is_fixed[static_cast<size_t>(node)];
    }));
  }
  return fixed;
}

std::vector<double> Places::LargestOf(const std::vector<double>& values) const {
  std::vector<double> largest(count());
  for (size_t b = 0; b < count(); ++b) {
    for (const int32_t node : corners_[b]) {
      if (node >= 0) largest[b] = std::max(largest[b], values[static_cast<size_t>(node)]);
    }
  }
  return largest;
}

std::vector<double> Places::AtNodes(const TetMesh& mesh, const std::vector<double>& values) const {
  std::vector<double> at_node(mesh.nodes.size(), 0);
  for (size_t b = 0; b < count(); ++b) {
    const double part = values[b] / (corners_[b][2] < 0 ? 2 : 3);
    for (const int32_t node : corners_[b]) {
      if (node >= 0) at_node[static_cast<size_t>(node)] += part;
    }
  }
  return at_node;
}

}  // namespace carillon::precompute
