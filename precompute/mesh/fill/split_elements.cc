// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/split_elements.h"

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// The tetrahedra at the corners, by the nodes of the divided one.
constexpr std::array<std::array<size_t, 4>, 4> kAtCorners = {
    {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}}};

/// A diagonal of the octahedron between the tetrahedra at the corners, and the ring of its other
/// nodes.
struct OctahedronDiagonal {
  std::array<size_t, 2> ends;
  std::array<size_t, 4> ring;
};
constexpr std::array<OctahedronDiagonal, 3> kDiagonals = {
    {{{4, 9}, {5, 6, 7, 8}}, {{5, 7}, {4, 6, 9, 8}}, {{6, 8}, {4, 5, 9, 7}}}};

/// The tetrahedra into which one is divided.
constexpr size_t kParts = 8;

class Splitter {
 public:
  explicit Splitter(const TetMesh& mesh) : mesh_(mesh) { split_.nodes = mesh.nodes; }

  TetMesh Split() && {
    for (size_t e = 0; e < mesh_.element_count(); ++e) SplitElement(&mesh_.elements[10 * e]);
    for (const BoundaryFace& face : mesh_.boundary) SplitFace(face);
    for (const int32_t region : mesh_.regions) {
      split_.regions.insert(split_.regions.end(), kParts, region);
    }
    AddMidsideNodes(split_);
    Fix();
    return std::move(split_);
  }

 private:
  Point At(int32_t node) const { return mesh_.nodes[static_cast<size_t>(node)]; }

  void Add(std::array<int32_t, 4> corners) {
    if (TetVolume(At(corners[0]), At(corners[1]), At(corners[2]), At(corners[3])) < 0) {
      std::swap(corners[2], corners[3]);
    }
    split_.elements.insert(split_.elements.end(), corners.begin(), corners.end());
  }

  /// The octahedron is divided along its shortest diagonal, which gives the best tetrahedra.
  void SplitElement(const int32_t* nodes) {
    for (const auto& [a, b, c, d] : kAtCorners) Add({nodes[a], nodes[b], nodes[c], nodes[d]});
    const auto length = [&](const OctahedronDiagonal& diagonal) {
      return Distance(At(nodes[diagonal.ends[0]]), At(nodes[diagonal.ends[1]]));
    };
    const OctahedronDiagonal* shortest = &kDiagonals[0];
    for (const OctahedronDiagonal& other : kDiagonals) {
      if (length(other) < length(*shortest)) shortest = &other;
    }
    const auto& [ends, ring] = *shortest;
    for (size_t i = 0; i < 4; ++i) {
      Add({nodes[ends[0]], nodes[ends[1]], nodes[ring[i]], nodes[ring[(i + 1) % 4]]});
    }
  }

  void SplitFace(const BoundaryFace& face) {
    const auto& n = face.nodes;
    for (const auto& [a, b, c] : kFaceInFour) {
      split_.boundary.push_back({{n[a], n[b], n[c], -1, -1, -1}, face.given_triangle});
    }
  }

  void Fix() {
    std::vector<bool> fixed(split_.nodes.size(), false);
    for (const int32_t node : mesh_.fixed) fixed[static_cast<size_t>(node)] = true;
    for (size_t e = 0; e < split_.element_count() && !mesh_.fixed.empty(); ++e) {
      const int32_t* nodes = &split_.elements[10 * e];
      for (size_t i = 0; i < kTetEdges.size(); ++i) {
        const auto [a, b] = kTetEdges[i];
        if (fixed[static_cast<size_t>(nodes[a])] && fixed[static_cast<size_t>(nodes[b])]) {
          fixed[static_cast<size_t>(nodes[4 + i])] = true;
        }
      }
    }
    for (size_t node = 0; node < fixed.size(); ++node) {
      if (fixed[node]) split_.fixed.push_back(static_cast<int32_t>(node));
    }
  }

  const TetMesh& mesh_;
  TetMesh split_;
};

}  // namespace

TetMesh SplitElements(const TetMesh& mesh) {
  assert(mesh.nodes_per_element == 10);
  return Splitter(mesh).Split();
}

}  // namespace carillon::precompute
