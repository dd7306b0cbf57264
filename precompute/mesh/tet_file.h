// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// What a file says of tetrahedra, not yet checked; nodes are named by their numbers in the file.
struct TetFile {
  /// Points, edges, faces and elements that belong together.
  struct Group {
    std::string name;
    /// Numbers of the nodes at the corners of each; kNoNode past the last.
    std::vector<std::array<int64_t, 4>> simplices;
  };
  static constexpr int64_t kNoNode = std::numeric_limits<int64_t>::min();

  std::vector<int64_t> node_numbers;
  std::vector<Point> nodes;       ///< their places
  int nodes_per_element = 0;      ///< 4 or 10; 0 where there is no tetrahedron
  std::vector<int64_t> elements;  ///< node numbers of each tetrahedron, in the order of TetMesh
  std::vector<Group> groups;

  /// Adds a simplex to the group of that name.
  void AddToGroup(const std::string& name, std::span<const int64_t> corners);
};

}  // namespace carillon::precompute
