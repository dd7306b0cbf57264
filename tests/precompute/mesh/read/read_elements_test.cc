// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Tetrahedra as Medit, TetGen, Abaqus and CalculiX write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "tests/precompute/mesh/mesh_files.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using ReadElementsTest = ReadMeshTest;

constexpr char kMeditHead[] = "MeshVersionFormatted 1\nDimension 3\n";
constexpr char kFourNodes[] = "Vertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";

TEST_F(ReadElementsTest, GiveTheMeshThatWasWritten) {
  for (const int nodes_per_element : {4, 10}) {
    const TetMesh box = SmallTetBox(nodes_per_element);
    ExpectSame(ReadTetsOf(ToMedit(box), "mesh"), box);
    ExpectSame(ReadTetsOf(ToTetgen(box, 0), "node"), box);
    ExpectSame(ReadTetsOf(ToTetgen(box, 1), "node"), box);
    ExpectSame(ReadTetsOf(ToInp(box), "inp"), box);
    ExpectSame(ReadTetsOf(ToTextGmsh(box)), box);
    ExpectSame(ReadTetsOf(ToBinaryGmsh(box)), box);
    ExpectSame(ReadTetsOf(ToTextGmsh41(box)), box);
    ExpectSame(ReadTetsOf(ToBinaryGmsh41(box)), box);
  }
}

TEST_F(ReadElementsTest, LengthsAreInMetres) {
  for (const auto& [file, format] :
       {std::pair(ToMedit(SmallTetBox(4)), "mesh"), {ToTetgen(SmallTetBox(4), 1), "node"}}) {
    const NamedMesh read = ReadNamed(file, format, 0.5);
    EXPECT_EQ(std::get<TetMesh>(read.mesh).nodes.back(), (Point{0.5, 0.25, 0.125}));
    EXPECT_EQ(read.names.vertices.at(24), (Point{0.5, 0.25, 0.125}));  // the last, numbered from 1
  }
}

TEST_F(ReadElementsTest, KeywordsOfMeditMayBeInLowerCase) {
  std::string text = ToMedit(SmallTetBox(4));
  absl::AsciiStrToLower(&text);
  ExpectSame(ReadTetsOf(text, "mesh"), SmallTetBox(4));
}

// Vertices make no group of their own where the triangles beside them have the same number, because
// meshers number corners so.
TEST_F(ReadElementsTest, ReferencesOfMeditAreGroups) {
  const NamedMesh read = ReadNamed(ToMedit(SmallTetBox(4)), "mesh");
  ASSERT_THAT(GroupNames(read), ElementsAre("5", "9"));
  EXPECT_EQ(read.names.groups[0].simplices.size(), SmallTetBox(4).boundary.size());
  EXPECT_THAT(read.names.groups[1].simplices, ElementsAre(std::array{0, -1, -1, -1}));
}

TEST_F(ReadElementsTest, BoundaryMarkersOfTetgenAreGroups) {
  const NamedMesh read = ReadNamed(ToTetgen(SmallTetBox(4), 0), "node");
  ASSERT_THAT(GroupNames(read), ElementsAre("5"));
  EXPECT_EQ(read.names.groups[0].simplices.size(), 2u);
}

TEST_F(ReadElementsTest, SetsOfAbaqusAreGroups) {
  const NamedMesh read = ReadNamed(ToInp(SmallTetBox(10)), "inp");
  const std::vector<MeshGroup>& groups = read.names.groups;
  ASSERT_THAT(GroupNames(read), ElementsAre("skin", "the body", "tip", "two"));
  EXPECT_EQ(groups[0].simplices.size(), SmallTetBox(10).boundary.size());
  EXPECT_EQ(groups[1].simplices.size(), SmallTetBox(10).element_count());
  EXPECT_THAT(groups[2].simplices, ElementsAre(std::array{0, -1, -1, -1}));
  EXPECT_THAT(groups[3].simplices, ElementsAre(groups[0].simplices[0], groups[0].simplices[1]));
}

TEST_F(ReadElementsTest, ShellsOfAbaqusAloneAreASurface) {
  const NamedMesh read = ReadNamed(
      "*NODE\n1, 0,0,0\n2, 1,0,0\n3, 1,1,0\n4, 0,1,0\n5, 0,0,1.\n*ELEMENT, TYPE=S4, ELSET=Base\n"
      "1, 1,4,3,2\n*ELEMENT, TYPE=S3\n2,1,2,5\n3,2,3,5\n4,3,4,5\n5,4,1,5\n*ELSET, ELSET=LID\n"
      "2, 3\nbase\n",
      "inp");
  EXPECT_EQ(std::get<SurfaceMesh>(read.mesh).triangles.size(), 6u);
  ASSERT_EQ(read.names.groups.size(), 2u);
  EXPECT_THAT(read.names.groups[0].triangles, ElementsAre(0, 1));
  EXPECT_THAT(read.names.groups[1].triangles, ElementsAre(2, 3, 0, 1));
}

TEST_F(ReadElementsTest, BadInpFilesAreRefusedWithTheLine) {
  const std::string nodes = "*NODE\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n";
  ExpectRefused(
      "inp",
      {
          {"Dear Carillon,\n", "line 1: data before the first keyword"},
          {"*NODE\n1, 0, zero, 0\n", "MESH_UNREADABLE: line 2: no node (\"number, x, y, z\")"},
          {"*NODE\n,\n", "line 2: no node"},
          {nodes + "*ELEMENT, TYPE=C3D8\n",
           "MESH_ELEMENT_UNSUPPORTED: the file has elements of type C3D8"},
          {nodes + "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4,1\n", "line 7: element 1 has too many nodes"},
          {nodes + "*ELEMENT, TYPE=C3D4\n1, 1,2,3\n*STEP\n", "element 1 has too few nodes"},
          {nodes + "*ELEMENT, TYPE=C3D4\n1, 1,2,3", "element 1 has too few nodes"},
          {nodes + "*ELEMENT, TYPE=C3D4\n1, 1,2,3,x\n", "line 7: no element"},
          {nodes + "*ELEMENT, TYPE=C3D4\n1, 1,2,3,9\n",
           "MESH_INDEX_OUT_OF_RANGE: element 1 names node 9"},
          {nodes + "*NSET, NSET=a, GENERATE\n1, 1000000000000\n", "line 7: no range of a set"},
          {"*NODE\n**@ 1 more.inp\n1, x, 0, 0\n", "line 1 of \"more.inp\": no node"},
          {"*NODE\n**@ 1 more.inp\n1, 0, 0, 0\n**@ 7 \nx\n", "line 7: no node"},
          {nodes, "MESH_EMPTY: "},
      });
}

// As a client sends it that does not know the files beside it.
TEST_F(ReadElementsTest, AnInpWithoutTheFileThatItIncludesIsRefusedWithItsName) {
  for (const char* file : {"*INCLUDE, INPUT=more.inp\n", "*NODE, INPUT=more.inp\n"}) {
    EXPECT_THAT(ParseMesh(file, "inp", 1).status().ToString(),
                HasSubstr("line 1: the file \"more.inp\" belongs here"));
  }
}

TEST_F(ReadElementsTest, MeditTrianglesAloneAreASurface) {
  const std::string faces = "Triangles 4\n1 3 2 7\n1 2 4 0\n2 3 4 0\n1 4 3 0\nEnd\n";
  const NamedMesh read = ReadNamed(std::string(kMeditHead) + kFourNodes + faces, "mesh");
  EXPECT_EQ(std::get<SurfaceMesh>(read.mesh).triangles.size(), 4u);
  ASSERT_EQ(read.names.groups.size(), 1u);
  EXPECT_THAT(read.names.groups[0].triangles, ElementsAre(0));
}

TEST_F(ReadElementsTest, TetgenPairIsReadWhicheverIsNamed) {
  const TetMesh box = SmallTetBox(4);
  const std::string both = ToTetgen(box, 1);
  const std::string stem = testing::TempDir() + "tetgen_pair_" + std::to_string(getpid());
  const size_t cut = both.find("# its elements");
  std::ofstream(stem + ".node") << both.substr(0, cut);
  std::ofstream(stem + ".ele") << both.substr(cut);
  for (const char* suffix : {".node", ".ele"}) {
    const NamedMesh read = ReadMesh(stem + suffix, "node", 1).value();
    ExpectSame(std::get<TetMesh>(read.mesh), box);
  }
  std::filesystem::remove(stem + ".ele");
  EXPECT_THAT(ReadMesh(stem + ".node", "node", 1).status().ToString(),
              HasSubstr("no numbers of tetrahedra and of their nodes, with which a .ele file"));
  std::filesystem::remove(stem + ".node");
}

TEST_F(ReadElementsTest, BadMeditFilesAreRefusedWithTheLine) {
  const std::string head = kMeditHead;
  ExpectRefused(
      "mesh",
      {
          {"Dear Carillon,\n",
           "MESH_UNREADABLE: the file cannot be read as Medit's .mesh: line 1: "},
          {"MeshVersionFormatted 2\nDimension 2\n", "line 2: its dimension is not 3"},
          {head + "Vertices\nmany\n", "line 4: no number of vertices"},
          {head + "Vertices 2\n0 0 0 0\n1 0\n", "no vertex (\"x y z reference\")"},
          {head + "Vertices 2000001\n", "MESH_TOO_LARGE: "},
          {head + kFourNodes + "Tetrahedra 2\n1 2 3 4 1\n", "no entry of Tetrahedra"},
          {head + kFourNodes + "Tetrahedra 1\n1 2 3 5 1\n",
           "MESH_INDEX_OUT_OF_RANGE: tetrahedron 0"},
          {head + kFourNodes + "Tetrahedra 1\n1 2 3 3 1\n", "MESH_ZERO_VOLUME: "},
          {head + kFourNodes + "Hexahedra 1\n1 2 3 4 1 2 3 4 0\n",
           "MESH_ELEMENT_UNSUPPORTED: the file has Hexahedra"},
          {head + kFourNodes + "TetrahedraP3 1\n1 2 3\n",
           "MESH_ELEMENT_UNSUPPORTED: the file has TetrahedraP3"},
          {head + kFourNodes + "Triangles 1\n1 2 9 0\n", "MESH_INDEX_OUT_OF_RANGE: triangle 0"},
          {head + kFourNodes + "End\n", "MESH_EMPTY: "},
          {head + "Vertices 1\nnan 0 0 0\nTetrahedra 1\n1 1 1 1 0\n", "MESH_NOT_FINITE: node 1"},
      });
}

TEST_F(ReadElementsTest, BadTetgenFilesAreRefusedWithTheLine) {
  const std::string nodes = "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
  ExpectRefused(
      "node",
      {
          {"Dear Carillon,\n",
           "MESH_UNREADABLE: line 1: no number of nodes, with which a .node file"},
          {"4 2 0 0\n", "line 1: no nodes in three dimensions"},
          {"4 3 0 0\n1 0 0\n", "line 2: no node (\"number x y z [attributes]\")"},
          {"4 3 0 1\n1 0 0 0\n", "line 2: no node (\"number x y z [attributes] marker\")"},
          {"2000001 3 0 0\n", "MESH_TOO_LARGE: "},
          {nodes, "no numbers of tetrahedra and of their nodes"},
          {nodes + "1 5 0\n", "MESH_ELEMENT_UNSUPPORTED: the file has tetrahedra of 5 nodes"},
          {nodes + "2 4 0\n1 1 2 3 4\n", "no tetrahedron (\"number nodes [attribute]\")"},
          {nodes + "1 4 0\n1 0 1 2 3\n", "MESH_INDEX_OUT_OF_RANGE: tetrahedron 0"},
          {nodes + "0 4 0\n", "MESH_EMPTY: "},
      });
}

TEST_F(ReadElementsTest, FilesThatEndEarlyAreRefused) {
  const TetMesh box = SmallTetBox(10);
  for (const auto& [file, format] : {std::pair(ToMedit(box), "mesh"),
                                     {ToTetgen(box, 1), "node"},
                                     {ToTextGmsh(box), "msh"},
                                     {ToBinaryGmsh(box), "msh"},
                                     {ToTextGmsh41(box), "msh"},
                                     {ToBinaryGmsh41(box), "msh"}}) {
    for (const size_t part : {3U, 5U, 40U}) {
      EXPECT_THAT(Refused(file.substr(0, file.size() - file.size() / part), format),
                  HasSubstr("MESH_UNREADABLE: "))
          << format << part;
    }
  }
}

}  // namespace
}  // namespace carillon::precompute
