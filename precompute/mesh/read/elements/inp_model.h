// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "precompute/mesh/read/elements/element_file.h"
#include "precompute/mesh/read/elements/inp_kind.h"
#include "precompute/mesh/read/elements/inp_motion.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// An element of a set, or a face of it (1 to 4, as the format counts them) of a surface.
struct InpMember {
  int64_t element;
  int face = 0;  ///< 0 is the whole element
};

/// The nodes and elements of a part, an instance or a file without parts, each with its own
/// numbers.
struct InpScope {
  struct Element {
    int64_t number;
    InpKind kind;
    size_t first_node;  ///< index into `element_nodes`
  };
  /// A set or surface. Elements may follow the set that names them.
  struct Set {
    std::string name;
    std::vector<int64_t> nodes;
    std::vector<InpMember> elements;
  };

  std::vector<int64_t> node_numbers;
  std::vector<Point> points;
  absl::flat_hash_map<int64_t, size_t> node_at;  ///< index by number
  std::vector<Element> elements;
  std::vector<int64_t> element_nodes;
  absl::flat_hash_map<int64_t, size_t> element_at;  ///< index by number
  std::vector<Set> sets;
  std::vector<MeshRegion> sections;  ///< the sets and materials of its solid sections

  /// Returns for each element the section that its set has, or an empty one.
  std::vector<MeshRegion> SectionsOfElements() const;

  /// Returns the set of that name, without regard to the case of letters, or null.
  Set* FindSet(const std::string& name);
  /// Returns the set of that name, new if there was none.
  Set& SetNamed(const std::string& name);
};

/// A placed scope: an instance, or all of a file without assembly.
struct InpBody {
  std::string name;
  InpScope scope;
  InpMotion motion = {};
};

/// A set of the assembly: members of one instance.
struct InpAssemblySet {
  std::string name;
  std::string instance;
  std::vector<int64_t> nodes;
  std::vector<InpMember> elements;
};

/// Joins bodies to one file of elements, each where it is placed. Nodes of different bodies stay
/// apart. The nodes of a single body, or of the only one with tetrahedra, keep their numbers. A set
/// that several bodies have is named "INSTANCE.SET".
///
/// Errors: MESH_INDEX_OUT_OF_RANGE, MESH_ELEMENT_UNSUPPORTED.
absl::StatusOr<ElementFile> JoinBodies(std::vector<InpBody> bodies,
                                       const std::vector<InpAssemblySet>& sets);

}  // namespace carillon::precompute
