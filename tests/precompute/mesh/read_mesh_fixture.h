// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "precompute/mesh/read/read_mesh.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {

/// Writes a mesh file and reads it.
class ReadMeshTest : public testing::Test {
 protected:
  absl::StatusOr<NamedMesh> Read(const std::string& bytes, const std::string& format,
                                 double metres_per_unit = 1) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    absl::StatusOr<NamedMesh> named = ReadMesh(path_, format, metres_per_unit);
    std::filesystem::remove(path_);
    return named;
  }

  /// A refusal ends the test.
  NamedMesh ReadNamed(const std::string& bytes, const std::string& format,
                      double metres_per_unit = 1) const {
    return Read(bytes, format, metres_per_unit).value();
  }

  SurfaceMesh ReadSurfaceOf(const std::string& bytes, const std::string& format) const {
    return std::get<SurfaceMesh>(ReadNamed(bytes, format).mesh);
  }

  TetMesh ReadTetsOf(const std::string& bytes, const std::string& format = "msh") const {
    return std::get<TetMesh>(ReadNamed(bytes, format).mesh);
  }

  std::string Refused(const std::string& bytes, const std::string& format) const {
    return Read(bytes, format).status().ToString();
  }

  /// Expects that each file is refused with these words.
  void ExpectRefused(const std::string& format,
                     const std::vector<std::pair<std::string, const char*>>& cases) const {
    for (const auto& [file, words] : cases) {
      EXPECT_THAT(Refused(file, format), testing::HasSubstr(words)) << format << ": " << file;
    }
  }

 private:
  // Tests run side by side, each in a process of its own.
  std::string path_ = testing::TempDir() + "mesh_of_" +
                      testing::UnitTest::GetInstance()->current_test_info()->name();
};

/// Has 24 nodes of four-node tetrahedra.
inline TetMesh SmallTetBox(int nodes_per_element) {
  return MakeTetBox({1, 0.5, 0.25}, {3, 2, 1}, nodes_per_element);
}

inline std::vector<std::string> GroupNames(const NamedMesh& named) {
  std::vector<std::string> names;
  for (const MeshGroup& group : named.names.groups) names.push_back(group.name);
  return names;
}

inline void ExpectSame(const TetMesh& read, const TetMesh& written) {
  EXPECT_EQ(read.nodes, written.nodes);
  EXPECT_EQ(read.nodes_per_element, written.nodes_per_element);
  EXPECT_EQ(read.elements, written.elements);
  ASSERT_EQ(read.boundary.size(), written.boundary.size());
  for (size_t f = 0; f < read.boundary.size(); ++f) {
    EXPECT_EQ(read.boundary[f].nodes, written.boundary[f].nodes);
    EXPECT_EQ(read.boundary[f].given_triangle, static_cast<int32_t>(f));
  }
}

}  // namespace carillon::precompute
