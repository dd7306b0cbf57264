// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <variant>

#include "precompute/mesh/read/read_mesh.h"

namespace carillon::precompute {

/// Writes a mesh file and reads it.
class ReadMeshTest : public testing::Test {
 protected:
  absl::StatusOr<Mesh> Read(const std::string& bytes, const std::string& format,
                            double metres_per_unit = 1) const {
    absl::StatusOr<NamedMesh> named = ReadNamed(bytes, format, metres_per_unit);
    if (!named.ok()) return named.status();
    return std::move(named->mesh);
  }

  absl::StatusOr<NamedMesh> ReadNamed(const std::string& bytes, const std::string& format,
                                      double metres_per_unit = 1) const {
    std::ofstream(path_, std::ios::binary) << bytes;
    absl::StatusOr<NamedMesh> named = ReadMesh(path_, format, metres_per_unit);
    std::filesystem::remove(path_);
    return named;
  }

  SurfaceMesh ReadSurfaceOf(const std::string& bytes, const std::string& format) const {
    const absl::StatusOr<Mesh> mesh = Read(bytes, format);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? std::get<SurfaceMesh>(*mesh) : SurfaceMesh{};
  }

  TetMesh ReadTetsOf(const std::string& bytes, const std::string& format = "msh") const {
    const absl::StatusOr<Mesh> mesh = Read(bytes, format);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? std::get<TetMesh>(*mesh) : TetMesh{};
  }

  std::string Refused(const std::string& bytes, const std::string& format) const {
    return Read(bytes, format).status().ToString();
  }

 private:
  // Tests run side by side, each in a process of its own.
  std::string path_ = testing::TempDir() + "mesh_of_" +
                      testing::UnitTest::GetInstance()->current_test_info()->name();
};

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
