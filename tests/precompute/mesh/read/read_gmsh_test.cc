// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <utility>

#include "tests/precompute/mesh/mesh_files.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using ReadGmshTest = ReadMeshTest;

std::string Header() { return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"; }

/// One tetrahedron whose fourth node has the coordinates `fourth`.
std::string OneTet(const std::string& fourth, const std::string& element) {
  return Header() + "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 " + fourth +
         "\n$EndNodes\n$Elements\n1\n" + element + "\n$EndElements\n";
}

TEST_F(ReadGmshTest, PhysicalGroupsOfVolumesAreRegions) {
  const NamedMesh read = ReadNamed(
      Header() + "$PhysicalNames\n2\n3 7 \"the head\"\n2 8 \"wall\"\n$EndPhysicalNames\n" +
          "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n"
          "$Elements\n3\n1 2 2 8 1 2 3 4\n2 4 2 7 1 1 2 3 4\n3 4 2 9 2 2 3 4 5\n$EndElements\n",
      "msh");
  EXPECT_EQ(read.names.regions, (std::vector<MeshRegion>{{"the head"}, {"9"}}));
  EXPECT_EQ(std::get<TetMesh>(read.mesh).regions, (std::vector<int32_t>{0, 1}));
}

// "gmsh -part 2" gives the elements to parts of the entities.
TEST_F(ReadGmshTest, PartitionedVolumesKeepTheirRegions) {
  const NamedMesh read = ReadNamed(
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
      "$PhysicalNames\n2\n3 1 \"steel\"\n3 2 \"ash\"\n$EndPhysicalNames\n"
      "$Entities\n0 0 0 2\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 1 2 0\n$EndEntities\n"
      "$PartitionedEntities\n2\n1\n9 1\n0 0 0 2\n3 3 1 2 1 2 0 0 0 1 1 1 1 1 0\n"
      "4 3 2 1 2 0 0 0 1 1 1 1 2 0\n$EndPartitionedEntities\n"
      "$Nodes\n1 5 1 5\n3 3 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n"
      "$Elements\n2 2 1 2\n3 3 4 1\n1 1 2 3 4\n3 4 4 1\n2 2 3 4 5\n$EndElements\n",
      "msh");
  EXPECT_THAT(read.names.regions, ElementsAre(MeshRegion{"steel"}, MeshRegion{"ash"}));
}

TEST_F(ReadGmshTest, TurnsMirroredTetrahedraRound) {
  for (const int nodes_per_element : {4, 10}) {
    const TetMesh box = SmallTetBox(nodes_per_element);
    TetMesh mirrored = box;
    for (size_t e = 0; e < box.elements.size(); e += static_cast<size_t>(nodes_per_element)) {
      int32_t* n = &mirrored.elements[e];
      std::swap(n[0], n[1]);
      if (nodes_per_element == 10) {
        std::swap(n[5], n[6]);
        std::swap(n[7], n[8]);
      }
    }
    ExpectSame(ReadTetsOf(ToTextGmsh(mirrored)), box);
  }
}

TEST_F(ReadGmshTest, PassesOverNodesThatNoTetrahedronHas) {
  const TetMesh box = SmallTetBox(4);
  TetMesh padded = box;
  padded.nodes.insert(padded.nodes.begin(), {9, 9, 9});
  for (int32_t& node : padded.elements) ++node;
  for (BoundaryFace& face : padded.boundary) {
    for (int32_t& node : face.nodes) ++node;
  }
  ExpectSame(ReadTetsOf(ToTextGmsh(padded)), box);
}

TEST_F(ReadGmshTest, TheVersionsTwoDifferInNothingThatIsRead) {
  const TetMesh box = SmallTetBox(4);
  for (const char* version : {"2", "2.1"}) {
    std::string text = ToTextGmsh(box);
    text.replace(text.find("2.2 "), 3, version);
    ExpectSame(ReadTetsOf(text), box);
  }
}

TEST_F(ReadGmshTest, AFileOfTrianglesAloneIsASurfaceWithItsGroups) {
  const std::string file =
      Header() +
      "$PhysicalNames\n1\n2 4 \"base\"\n$EndPhysicalNames\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n"
      "4 0 1 0\n5 0 0 1\n$EndNodes\n$Elements\n5\n1 3 2 4 1 1 4 3 2\n2 2 0 1 2 5\n3 2 0 2 3 5\n"
      "4 2 0 3 4 5\n5 2 0 4 1 5\n$EndElements\n";
  const NamedMesh read = ReadNamed(file, "msh");
  const auto& surface = std::get<SurfaceMesh>(read.mesh);
  EXPECT_EQ(surface.vertices.size(), 5u);
  ASSERT_EQ(surface.triangles.size(), 6u);  // the quadrangle gives two
  ASSERT_THAT(GroupNames(read), ElementsAre("base"));
  EXPECT_THAT(read.names.groups[0].triangles, ElementsAre(0, 1));
  EXPECT_EQ(read.names.vertices.at(5), (Point{0, 0, 1}));
}

TEST_F(ReadGmshTest, TetrahedraOfBothKindsAreRefused) {
  std::string text = ToTextGmsh(SmallTetBox(10));
  text.replace(text.rfind("$EndElements"), 12, "999 4 0 11 12 13 14\n$EndElements");
  const size_t count = text.find("$Elements\n") + 10;
  const size_t end = text.find('\n', count);
  text.replace(count, end - count, std::to_string(std::stoi(text.substr(count)) + 1));
  EXPECT_THAT(Refused(text, "msh"),
              HasSubstr("MESH_ELEMENT_UNSUPPORTED: the file has tetrahedra of 4"));
}

TEST_F(ReadGmshTest, MidsideNodesInAnotherOrderAreRefused) {
  TetMesh box = SmallTetBox(10);
  for (size_t e = 0; e < box.elements.size(); e += 10) {
    std::swap(box.elements[e + 8], box.elements[e + 9]);
  }
  EXPECT_THAT(Refused(ToTextGmsh(box), "msh"), HasSubstr("MESH_ELEMENT_INVERTED: "));
}

TEST_F(ReadGmshTest, PhysicalGroupsAreThoseOfTheEntities) {
  for (const std::string& file : {ToTextGmsh41(SmallTetBox(4)), ToBinaryGmsh41(SmallTetBox(4))}) {
    const NamedMesh read = ReadNamed(file, "msh");
    EXPECT_THAT(GroupNames(read), ElementsAre("skin", "5", "body"));
    EXPECT_EQ(read.names.groups[0].simplices.size(), SmallTetBox(4).boundary.size());
    EXPECT_EQ(read.names.groups[2].simplices.size(), SmallTetBox(4).element_count());
  }
}

TEST_F(ReadGmshTest, BadFilesAreRefused) {
  const std::string head = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::string many = "1152921504606846976";  // 2^60, which no file can hold
  ExpectRefused(
      "msh",
      {
          {"$MeshFormat\n4 0 8\n$EndMeshFormat\n",
           "MESH_UNREADABLE: the file cannot be read as Gmsh MSH 2.2 or 4.1: its version is \"4\""},
          {"\n(0 \"a case of Fluent\")\n(2 3)\n", "a .msh of Fluent"},
          {"$MeshFormat\n4.1 1 4\n", "numbers have not eight bytes"},
          {OneTet("0 0 1", "1 1 0 1 2"), "MESH_EMPTY: "},
          {OneTet("0 0 1", "1 4 2 0 0 1 2 3 5"),
           "MESH_INDEX_OUT_OF_RANGE: tetrahedron 0 (counted from zero) names node 5"},
          {OneTet("0 0 nan", "1 4 2 0 0 1 2 3 4"), "MESH_NOT_FINITE: node 4"},
          {OneTet("0 0 -inf", "1 4 2 0 0 1 2 3 4"), "MESH_NOT_FINITE: node 4"},
          {OneTet("0 0 1e999", "1 4 2 0 0 1 2 3 4"), "MESH_NOT_FINITE: node 4"},
          {OneTet("0.5 0.25 0", "1 4 0 1 2 3 4"), "MESH_ZERO_VOLUME: tetrahedron 0"},
          {Header() + "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n1 5 5 5\n$EndNodes\n" +
               "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n",
           "the file has node 1 twice, at different places"},
          {OneTet("0 0 1", "1 5 0 1 2 3 4 1 2 3 4"),
           "MESH_ELEMENT_UNSUPPORTED: the file has an element of Gmsh's type 5"},
          {head + "$Nodes\n1 " + many + " 1 9\n", "MESH_TOO_LARGE"},
          {head + "$Nodes\n1 9 1 9\n3 1 0 " + many + "\n", "MESH_TOO_LARGE"},
          {head + "$Nodes\n" + many + " 9 1 9\n", "MESH_UNREADABLE"},
          {head + "$Entities\n0 " + many + " 0 0\n", "MESH_UNREADABLE"},
          {head + "$Elements\n1 9 1 9\n3 1 4 " + many + "\n", "MESH_UNREADABLE"},
      });
}

TEST_F(ReadGmshTest, AMeshOverTheLimitIsRefused) {
  const std::string nodes(9 * 2'000'001, '\n');
  EXPECT_THAT(Refused(Header() + "$Nodes\n2000001\n" + nodes, "msh"),
              HasSubstr("RESOURCE_EXHAUSTED: MESH_TOO_LARGE: the mesh has 2000001 nodes"));
}

}  // namespace
}  // namespace carillon::precompute
