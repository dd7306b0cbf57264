// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The unchecked content of a file of nodes and elements. Nodes are identified by their numbers in
/// the file.
struct ElementFile {
  /// A named group of points, edges, faces and elements.
  struct Group {
    std::string name;
    /// For each point, edge, face or element, the numbers of its corner nodes, filled up with
    /// kNoNode.
    std::vector<std::array<int64_t, 4>> simplices;
    /// Indices into `triangles`.
    std::vector<int32_t> triangles;
  };
  static constexpr int64_t kNoNode = std::numeric_limits<int64_t>::min();

  std::vector<int64_t> node_numbers;
  std::vector<Point> nodes;       ///< the position of each node
  int nodes_per_element = 0;      ///< 4 or 10, or 0 if there is no tetrahedron
  std::vector<int64_t> elements;  ///< node numbers of each tetrahedron, in the order of TetMesh
  std::vector<std::array<int64_t, 3>>
      triangles;  ///< triangles of surfaces that bound or divide the body
  std::vector<Group> groups;
  std::vector<MeshRegion> regions;       ///< each once
  std::vector<int32_t> element_regions;  ///< the region of each tetrahedron
  std::vector<std::string> warnings;     ///< what the reader left out, for the user

  /// Returns the group of that name, new if there was none.
  Group& Named(const std::string& name);
  /// Adds a simplex to each of the named groups.
  void AddToGroups(std::span<const std::string> names, std::span<const int64_t> corners);
  /// Adds the triangle or triangles (one, two or four) into which a face is split.
  void AddTriangles(std::span<const std::string> names,
                    std::span<const std::array<int64_t, 3>> pieces);
  /// Adds a tetrahedron of 4 or 10 nodes. Errors: MESH_ELEMENT_UNSUPPORTED (a file has both kinds).
  absl::Status AddTetrahedron(std::span<const int64_t> nodes_of_one, const MeshRegion& region = {});
};

/// Checks the number of nodes of a file. Errors: MESH_TOO_LARGE if it exceeds the limit.
absl::Status CheckNodeCountOfFile(size_t count);

/// Returns the error MESH_ELEMENT_UNSUPPORTED for a file that contains `what`.
absl::Status UnsupportedElements(absl::string_view what);

}  // namespace carillon::precompute
