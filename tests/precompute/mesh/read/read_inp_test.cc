// SPDX-License-Identifier: AGPL-3.0-or-later
//
// What input files of Abaqus and CalculiX can say of nodes and elements: it is computed, or refused
// by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using ReadInpTest = ReadMeshTest;

constexpr char kNodes[] = "*NODE\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n";
constexpr char kElement[] = "*ELEMENT, TYPE=C3D4, ELSET=all\n1, 1,2,3,4\n";

std::string Part(const std::string& name) {
  return "*PART, NAME=" + name + "\n" + kNodes + kElement + "*NSET, NSET=tip\n4\n*END PART\n";
}

/// The nodes of the only tetrahedron.
void ExpectNodes(const TetMesh& mesh, const std::vector<Point>& nodes) {
  ASSERT_EQ(mesh.nodes.size(), nodes.size());
  for (size_t n = 0; n < nodes.size(); ++n) {
    EXPECT_LT(Distance(mesh.nodes[n], nodes[n]), 1e-12) << n;
  }
}

TEST_F(ReadInpTest, NumbersAreReadAsFortranWritesThem) {
  const TetMesh mesh = ReadTetsOf(
      std::string("*NODE\n1, -0., .0, 0.D0\n2, +1.D-3, 0, 0\n3, 0, 1-3,\n4, 0., , 1.0E-03\n") +
          kElement,
      "inp");
  ExpectNodes(mesh, {{0, 0, 0}, {1e-3, 0, 0}, {0, 1e-3, 0}, {0, 0, 1e-3}});
}

TEST_F(ReadInpTest, CylindricalNodesAndLocalSystemsArePlaced) {
  ExpectNodes(
      ReadTetsOf(
          std::string("*NODE, SYSTEM=C\n1, 0,0,0\n2, 1,0,0\n3, 1,90.,0\n4, 0,0,1\n") + kElement,
          "inp"),
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  // The first axis points along y, the second along -x.
  ExpectNodes(
      ReadTetsOf(std::string("*SYSTEM\n5., 6., 7., 5., 9., 7.\n4., 6., 7.\n") + kNodes + kElement,
                 "inp"),
      {{5, 6, 7}, {5, 7, 7}, {4, 6, 7}, {5, 6, 8}});
}

TEST_F(ReadInpTest, AnInstanceIsMovedAndThenTurned) {
  const TetMesh mesh =
      ReadTetsOf(Part("Bar") +
                     "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=B, PART=bar\n 1., 0., 0.\n"
                     " 0., 0., 0., 0., 0., 1., 90.\n*END INSTANCE\n*END ASSEMBLY\n",
                 "inp");
  ExpectNodes(mesh, {{0, 1, 0}, {0, 2, 0}, {-1, 1, 0}, {0, 1, 1}});
}

// CAE numbers a reference point of the assembly from 1, as it does the nodes of each part.
TEST_F(ReadInpTest, NodesOfTheAssemblyAreNotThoseOfTheParts) {
  const NamedMesh read = ReadNamed(
      Part("Bar") +
          "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=B-1, PART=Bar\n*END INSTANCE\n*NODE\n1, 9,9,9\n"
          "*NSET, NSET=fixed, INSTANCE=B-1\n2, 3\n*NSET, NSET=mixed\nB-1.tip, B-1.1\n"
          "*NSET, NSET=tip, INSTANCE=B-1\n1\n*END ASSEMBLY\n",
      "inp");
  ExpectNodes(std::get<TetMesh>(read.mesh), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_THAT(GroupNames(read), ElementsAre("all", "B-1.tip", "fixed", "mixed", "tip"));
  EXPECT_THAT(read.names.groups[2].simplices,
              ElementsAre(std::array{1, -1, -1, -1}, std::array{2, -1, -1, -1}));
  EXPECT_EQ(read.names.groups[3].simplices.size(), 2U);
  EXPECT_THAT(read.warnings, IsEmpty());
}

TEST_F(ReadInpTest, APartThatNoInstancePlacesIsNotThere) {
  const TetMesh mesh = ReadTetsOf(Part("Bar") + Part("Tool") +
                                      "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=B, PART=Tool\n"
                                      "*END INSTANCE\n*END ASSEMBLY\n",
                                  "inp");
  EXPECT_EQ(mesh.element_count(), 1U);
}

// A tool of rigid faces beside the body has numbers of its own.
TEST_F(ReadInpTest, TheOnlySolidInstanceKeepsItsNumbers) {
  const NamedMesh read = ReadNamed(
      Part("Bar") +
          "*PART, NAME=Tool\n*NODE\n1, 5,5,5\n2, 6,5,5\n3, 5,6,5\n*ELEMENT, TYPE=R3D3\n1, 1,2,3\n"
          "*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=T, PART=Tool\n*END INSTANCE\n"
          "*INSTANCE, NAME=B, PART=Bar\n*END INSTANCE\n*END ASSEMBLY\n",
      "inp");
  EXPECT_EQ(read.names.vertices.at(2), (Point{1, 0, 0}));
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("1 triangles of the file have nodes")));
}

TEST_F(ReadInpTest, ASetMayComeBeforeItsElements) {
  const NamedMesh read =
      ReadNamed(std::string("*ELSET, ELSET=\"a, b\"\n1,\n") + kNodes + kElement, "inp");
  EXPECT_EQ(read.names.groups[0].name, "a, b");
  EXPECT_EQ(read.names.groups[0].simplices.size(), 1U);
}

// A closed shell is no solid; a body is not what sections of shells, of trusses and of sets that
// are not there say.
TEST_F(ReadInpTest, WhatIsNotUsedIsNamed) {
  const std::string flat = std::string(kNodes) + kElement;
  const std::vector<std::pair<std::string, std::vector<const char*>>> cases = {
      {flat + "*BOUNDARY\n1, 1, 3\n*STEP\n*BOUNDARY\n2, 1\n", {"*BOUNDARY of the file (line 8)"}},
      {flat + "*NSET, NSET=tip, ELSET=none\n", {"the set \"none\" is not there"}},
      {std::string(kNodes) + "*ELEMENT, TYPE=S3, ELSET=skin\n2, 1,3,2\n3, 1,2,4\n4, 2,3,4\n" +
           "5, 1,4,3\n*SHELL SECTION, ELSET=skin, MATERIAL=Steel\n0.001, 5\n",
       {"*SHELL SECTION of the file (line 11)"}},
      {flat + "*ELEMENT, TYPE=T3D2, ELSET=wire\n2, 1,2\n" +
           "*SOLID SECTION, ELSET=wire, MATERIAL=Steel\n*SOLID SECTION, ELSET=Heda, "
           "MATERIAL=Steel\n",
       {"\"wire\" is not used, because the set has", "\"Heda\" is not used, because the set is"}},
      {flat + "*MATERIAL, NAME=Steel\n*DENSITY\n7.85e-9,\n*ELASTIC\n 210000., .3, 20.\n" +
           "190000., .3, 300.\n*DAMPING, BETA=1e-6\n*Material, name=Air\n",
       {"the figures of the file's material \"Steel\" (*DENSITY 7.85e-9; *ELASTIC 210000., .3, "
        "20.) "
        "are not used, but those of the given material"}},
      {std::string(kNodes) + "5, 9,9,9\n" + kElement + "*ELEMENT, TYPE=S3\n2, 1,2,3\n3, 1,2,5\n",
       {"1 triangles of the file have nodes"}},
  };
  for (const auto& [file, words] : cases) {
    const std::vector<std::string> warnings = ReadNamed(file, "inp").warnings;
    ASSERT_EQ(warnings.size(), words.size()) << file;
    for (size_t i = 0; i < words.size(); ++i) EXPECT_THAT(warnings[i], HasSubstr(words[i]));
  }
}

TEST_F(ReadInpTest, WhatIsNotReadIsRefusedByName) {
  const std::string flat = std::string(kNodes) + kElement;
  ExpectRefused(
      "inp", {
                 {"*NODE, SYSTEM=S\n1, 0,0,0\n", "line 1: it has *NODE, SYSTEM=S"},
                 {flat + "*NGEN\n1, 2\n", "line 8: it has *NGEN"},
                 {flat + "*End  Part\n*Ncopy, change number=10\n", "it has *NCOPY"},
                 {flat + "*NODE\n1, 5,5,5\n", "line 9: node 1 is there twice, at different places"},
                 {flat + "*ELEMENT, TYPE=C3D4\n1, 2,1,3,4\n",
                  "line 9: element 1 is there twice, with different nodes"},
                 {flat + "*ELEMENT, TYPE=B31\n2, 1,2\n",
                  "MESH_ELEMENT_UNSUPPORTED: the file has elements of type B31 (line 8)"},
                 {"8 6 0 0 0\n1 0. 0. 0.\n", "line 1: data before the first keyword"},
                 {"*INSTANCE, NAME=a, PART=none\n",
                  "an instance of the part \"none\", which is not there"},
                 {flat + "*SYSTEM\n0,0,0, 1,0,0\n2,0,0\n",
                  "no points of *SYSTEM, or they lie on one line"},
                 {Part("Bar") +
                      "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=B-1, PART=Bar\n*END INSTANCE\n"
                      "*INSTANCE, NAME=B-2, PART=Bar\n0., 0., 5.\n*END INSTANCE\n*END ASSEMBLY\n",
                  "MESH_SEVERAL_PIECES: only 1 of 2 tetrahedra"},
             });
}

TEST_F(ReadInpTest, SectionsDivideTheBodyIntoRegions) {
  const NamedMesh read =
      ReadNamed(std::string("*SOLID SECTION, ELSET=handle, MATERIAL=Ash\n") + kNodes +
                    "5, 1,1,1\n*ELEMENT, TYPE=C3D4, ELSET=head\n7, 2,3,4,5\n"
                    "*ELEMENT, TYPE=C3D4, ELSET=Handle\n1, 1,2,3,4\n"
                    "*SOLID SECTION, ELSET=HEAD, MATERIAL=Steel\n",
                "inp");
  EXPECT_THAT(read.names.regions,
              ElementsAre(MeshRegion{"HEAD", "Steel"}, MeshRegion{"handle", "Ash"}));
  EXPECT_THAT(std::get<TetMesh>(read.mesh).regions, ElementsAre(0, 1));
}

TEST_F(ReadInpTest, ANodeThatIsThereTwiceAtOnePlaceIsOneNode) {
  EXPECT_EQ(ReadTetsOf(std::string(kNodes) + "*NODE, NSET=again\n1, 0., 0., 0.\n" + kElement, "inp")
                .nodes.size(),
            4U);
}

TEST_F(ReadInpTest, AnElementThatIsThereTwiceIsOneElementOfBothSets) {
  const NamedMesh read = ReadNamed(
      std::string(kNodes) + kElement + "*ELEMENT, TYPE=C3D4, ELSET=again\n1, 1,2,3,4\n", "inp");
  EXPECT_EQ(std::get<TetMesh>(read.mesh).element_count(), 1U);
  ASSERT_EQ(read.names.groups.size(), 2U);
  EXPECT_EQ(read.names.groups[0].simplices, read.names.groups[1].simplices);
}

TEST_F(ReadInpTest, ASetOfNodesMayBeThoseOfASetOfElements) {
  const NamedMesh read =
      ReadNamed(std::string(kNodes) + kElement + "*NSET, NSET=tip, ELSET=All\n", "inp");
  ASSERT_EQ(read.names.groups.back().name, "tip");
  EXPECT_EQ(read.names.groups.back().simplices.size(), 4U);
}

// The element 1 has the nodes 1, 2, 3 and 4; its face S3 lies opposite of node 1.
TEST_F(ReadInpTest, SurfacesAreGroupsOfTheirFacesOrNodes) {
  const std::string elements = std::string("*ASSEMBLY, NAME=A\n*INSTANCE, NAME=B, PART=Bar\n") +
                               "*END INSTANCE\n*ELSET, ELSET=_S3, INTERNAL, INSTANCE=B\n1\n" +
                               "*SURFACE, TYPE=ELEMENT, NAME=clamp\n_S3, S3\n";
  const NamedMesh read = ReadNamed(
      Part("Bar") + elements + "*SURFACE, TYPE=NODE, NAME=two\nB.tip, 1.\nB.1\n*END ASSEMBLY\n",
      "inp");
  const auto group = [&](const std::string& name) {
    const auto found = std::ranges::find(read.names.groups, name, &MeshGroup::name);
    return found == read.names.groups.end() ? MeshGroup{} : *found;
  };
  EXPECT_THAT(group("clamp").simplices, ElementsAre(std::array{1, 3, 2, -1}));
  EXPECT_THAT(group("two").simplices,
              ElementsAre(std::array{3, -1, -1, -1}, std::array{0, -1, -1, -1}));
  EXPECT_THAT(read.warnings, IsEmpty());
}

}  // namespace
}  // namespace carillon::precompute
