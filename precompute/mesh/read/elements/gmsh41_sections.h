// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/status/status.h"
#include "precompute/mesh/read/elements/gmsh_elements.h"
#include "precompute/mesh/read/text/number_stream.h"

namespace carillon::precompute {

/// Readers of the sections in which MSH 4.1 differs from 2.2. Each function reads `stream` from the
/// position behind the name of its section. https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format
/// Errors: MESH_UNREADABLE, MESH_TOO_LARGE, MESH_ELEMENT_UNSUPPORTED.
class Gmsh41Sections {
 public:
  explicit Gmsh41Sections(GmshElements& elements) : elements_(elements) {}

  /// Reads the physical groups of the points, curves, surfaces and volumes of the geometry.
  absl::Status ReadEntities(NumberStream& stream);
  absl::Status ReadPartitionedEntities(NumberStream& stream);
  absl::Status ReadNodes(NumberStream& stream);
  absl::Status ReadElements(NumberStream& stream);

 private:
  absl::Status ReadAllEntities(bool partitioned, NumberStream& stream);
  bool ReadEntity(int dimension, bool partitioned, NumberStream& stream);
  absl::Status ReadNodeBlock(NumberStream& stream);
  absl::Status ReadElementBlock(NumberStream& stream);

  GmshElements& elements_;
  std::map<std::array<int32_t, 2>, std::vector<int32_t>> physicals_;  // by dimension and number
};

}  // namespace carillon::precompute
