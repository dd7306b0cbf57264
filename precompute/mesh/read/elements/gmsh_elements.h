// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "precompute/mesh/read/elements/element_file.h"

namespace carillon::precompute {

/// A kind of element by its type in Gmsh's files.
struct GmshKind {
  int type;
  int dimension;
  size_t node_count;
  size_t corner_count;
};

/// Returns the kind of points, lines, triangles, quadrangles and tetrahedra of first and second
/// order, and null for other types.
const GmshKind* FindGmshKind(int type);

/// Returns the error for an element of any other type.
absl::Status UnknownGmshKind(int type);

/// Elements of a Gmsh file of any version, as they are read.
struct GmshElements {
  /// Adds an element to the file and to its physical groups. A group is identified by its name. A
  /// group without a name is identified by its number, unless it contains volumes, because numbers
  /// of volumes stand for materials. Zero means no group. In MSH 2.2 Gmsh repeats an element for
  /// each of its groups, in lines that follow one another; the mesh gets it once.
  absl::Status Add(const GmshKind& kind, std::span<const int32_t> physicals,
                   std::span<const int64_t> nodes);

  ElementFile file;
  std::map<std::array<int32_t, 2>, std::string> physical_names;  ///< by dimension and number
  int last_type = 0;  ///< the type and nodes of the element that was added last
  std::vector<int64_t> last_nodes;
};

}  // namespace carillon::precompute
