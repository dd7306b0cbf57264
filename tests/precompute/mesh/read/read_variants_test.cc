// SPDX-License-Identifier: AGPL-3.0-or-later
//
// The same box in the variants of each format that programs write.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "tests/precompute/mesh/mesh_files.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kVolume = 0.03;

class ReadVariantsTest : public ReadMeshTest {
 protected:
  void ExpectBox(const std::string& bytes, const std::string& format) const {
    const SurfaceMesh read = ReadSurfaceOf(bytes, format);
    ASSERT_TRUE(CheckSurface(read).ok()) << CheckSurface(read).status();
    EXPECT_NEAR(FindShells(read).front().volume_m3, kVolume, 1e-7);
  }

  const SurfaceMesh box_ = MakeBoxSurface({0.5, 0.3, 0.2});
};

constexpr char kMark[] = "\xEF\xBB\xBF";

TEST_F(ReadVariantsTest, AByteOrderMarkIsNoPartOfAText) {
  ExpectBox(kMark + ToObj(box_), "obj");
  ExpectBox(kMark + ToOff(box_), "off");
  ExpectBox(kMark + ToTextPly(box_), "ply");
  ExpectBox(kMark + ToTextStl(box_), "stl");
  const TetMesh tets = SmallTetBox(4);
  ExpectSame(ReadTetsOf(kMark + ToTextGmsh(tets)), tets);
  ExpectSame(ReadTetsOf(kMark + ToMedit(tets), "mesh"), tets);
  ExpectSame(ReadTetsOf(kMark + ToTetgen(tets, 1), "node"), tets);
  ExpectSame(ReadTetsOf(kMark + ToInp(tets), "inp"), tets);
}

TEST_F(ReadVariantsTest, LinesMayEndByACarriageReturn) {
  for (const char* end : {"\r", "\r\n"}) {
    ExpectBox(absl::StrReplaceAll(ToObj(box_), {{"\n", end}}), "obj");
    ExpectBox(absl::StrReplaceAll(ToTextStl(box_), {{"\n", end}}), "stl");
  }
}

TEST_F(ReadVariantsTest, ABodyFarAwayIsMovedBeforeItsNumbersAreRounded) {
  std::string text;
  for (const Point& p : box_.vertices) {
    absl::StrAppendFormat(&text, "v %.6f %.6f %.6f\n", p[0] + 441871, p[1] + 329700, p[2] + 12);
  }
  const std::string obj = ToObj(box_);
  const NamedMesh read = ReadNamed(text + obj.substr(obj.find("\nf ")), "obj");
  const auto& surface = std::get<SurfaceMesh>(read.mesh);
  EXPECT_NEAR(FindShells(surface).front().volume_m3, kVolume, 1e-6);
  EXPECT_EQ(read.names.origin_m, (Point{441871, 329700, 12}));
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("counted from (441871, 329700, 12) m")));
}

TEST_F(ReadVariantsTest, ConcavePolygonsAreSplitWithinThemselves) {
  // A prism over the letter L: 0.05 of its square of 0.09 is cut out.
  ExpectBox(
      "v 0 0 0\nv .3 0 0\nv .3 .1 0\nv .1 .1 0\nv .1 .3 0\nv 0 .3 0\n"
      "v 0 0 .6\nv .3 0 .6\nv .3 .1 .6\nv .1 .1 .6\nv .1 .3 .6\nv 0 .3 .6\n"
      "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\n"
      "f 5 6 12 11\nf 6 1 7 12\n",
      "obj");
}

TEST_F(ReadVariantsTest, VerticesOfObjMayHaveAWeightOfOneOrAColour) {
  for (const char* more : {" 1.0", " 1 0.5 0", " 1 0.5 0 1"}) {
    const std::string obj = ToObj(box_);
    const size_t faces = obj.find("\nf ") + 1;
    ExpectBox(absl::StrReplaceAll(obj.substr(0, faces), {{"\n", absl::StrCat(more, "\n")}}) +
                  obj.substr(faces),
              "obj");
  }
  EXPECT_THAT(Refused("v 1 2 3 2\n", "obj"), HasSubstr("line 1: a vertex with the weight \"2\""));
  EXPECT_THAT(Refused("v 1 2 3 4 5\n", "obj"), HasSubstr("line 1: a vertex with 5 numbers"));
}

TEST_F(ReadVariantsTest, WhatAnObjSaysBesidePolygonsIsRefusedOrNamed) {
  EXPECT_THAT(Refused(ToObj(box_) + "surf 0 1 0 1 1 2 3 4\n", "obj"),
              HasSubstr("line 22: the statement \"surf\""));
  EXPECT_THAT(Refused(ToObj(box_) + "call more.obj\n", "obj"), HasSubstr("\"call\""));
  const NamedMesh read = ReadNamed(ToObj(box_) + "wobble 1\n", "obj");
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("1 lines of the file are no statements")));
}

TEST_F(ReadVariantsTest, WordsOfOthersAreQuotedLegiblyAndInShort) {
  for (const auto& [file, format] :
       {std::pair{std::string("v 1 2 3\nv caf\xe9 0 0\nf 1 1 1\n"), "obj"},
        {std::string("OFF\n1 1 0\ncaf\xe9 0 0\n"), "off"}}) {
    EXPECT_THAT(Refused(file, format), HasSubstr("\"caf\\xe9\" is no coordinate"));
  }
  const std::string refusal = Refused("v 1 2 " + std::string(100'000, 'x'), "obj");
  EXPECT_THAT(refusal, HasSubstr("xxx...\" is no coordinate"));
  EXPECT_LT(refusal.size(), 300U);
}

TEST_F(ReadVariantsTest, OffIsReadAsItsFirstWordSays) {
  const auto with = [&](const std::string& first, const std::string& more) {
    std::string off =
        absl::StrCat(first, "\n", box_.vertices.size(), " ", box_.triangles.size(), " 0\n");
    for (const Point& p : box_.vertices) {
      absl::StrAppend(&off, p[0], " ", p[1], " ", p[2], more, "\n");
    }
    for (const auto& t : box_.triangles) {
      absl::StrAppend(&off, "3 ", t[0], " ", t[1], " ", t[2], " 255 0 0 # red\n");
    }
    return off;
  };
  ExpectBox(with("OFF", ""), "off");
  ExpectBox(with("COFF", " 9 9 9 255"), "off");
  ExpectBox(with("NOFF", " 0 0 1"), "off");
  ExpectBox(with("STCN4OFF", " 1 0 0 1 .5 .5 9 9 9"), "off");
  ExpectBox(with("NCOFF", " 9 9 9 255 0 0 1"), "off");
  ExpectBox("OFF" + with("", "").substr(1), "off");  // as in the data sets ModelNet
  ExpectBox(with("", ""), "off");
  ExpectBox(with("OFF", " 9 9 9"), "off");
  EXPECT_THAT(Refused(with("OFF", " 9 9"), "off"), HasSubstr("a vertex with 5 numbers"));
  EXPECT_THAT(Refused("OFF BINARY\n", "off"), HasSubstr("binary OFF files are not read"));
  EXPECT_THAT(Refused("4nOFF\n", "off"), HasSubstr("an OFF file begins with"));
  EXPECT_THAT(Refused(ToOff(box_) + "3 0 1 2\n", "off"),
              HasSubstr("the file goes on after the 12 faces"));
}

TEST_F(ReadVariantsTest, NamesInAnObjMayHaveBlanks) {
  const std::string obj = ToObj(box_);
  const size_t middle = obj.find("\nf ", obj.size() - 60) + 1;
  const NamedMesh read = ReadNamed("o My box \nusemtl Brushed Steel\n" + obj.substr(0, middle) +
                                       "usemtl Brushed Wood  # the handle\n" + obj.substr(middle),
                                   "obj");
  EXPECT_THAT(read.names.regions, ElementsAre(MeshRegion{"My box", "Brushed Steel"},
                                              MeshRegion{"My box", "Brushed Wood"}));
  EXPECT_THAT(GroupNames(read), ElementsAre("My box"));
}

TEST_F(ReadVariantsTest, TextStlMayBeInCapitalsAndHaveSeveralSolids) {
  const std::string stl = ToTextStl(box_);
  ExpectBox(absl::AsciiStrToUpper(stl), "stl");
  for (const char* word : {"normal", "outer", "vertex", "endloop", "endfacet"}) {
    const std::string cut = stl.substr(0, stl.rfind(word) + 4);
    EXPECT_THAT(Read(cut, "stl").status().ToString(), HasSubstr("the file ends")) << word;
  }
  const size_t middle = stl.find("endfacet", stl.size() / 2) + 8;
  ExpectBox(stl.substr(0, middle) + "\nendsolid one\nsolid facet two\n" + stl.substr(middle),
            "stl");
  ExpectBox(stl + "\x1a", "stl");  // ends texts of DOS
  EXPECT_THAT(Refused(absl::StrReplaceAll(stl, {{"vertex 0 ", "vertex 0,0 "}}), "stl"),
              AllOf(HasSubstr("MESH_UNREADABLE"), HasSubstr("no vertex")));
  EXPECT_THAT(Refused("# made by hand\n" + stl, "stl"),
              HasSubstr("it begins neither with \"solid\" nor"));
}

TEST_F(ReadVariantsTest, BinaryStlMayBeginWithSolidAndEndWithMore) {
  std::string stl = ToBinaryStl(box_);
  stl.replace(0, 5, "solid");
  ExpectBox(stl, "stl");
  ExpectBox(stl + std::string(100, '\0'), "stl");
  const NamedMesh read = ReadNamed(stl + "a footer", "stl");
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("8 bytes after the last triangle")));
  EXPECT_THAT(Refused(stl.substr(0, stl.size() - 50), "stl"),
              HasSubstr("its header says that it has 12 triangles, and 11 follow"));
}

TEST_F(ReadVariantsTest, SolidsOfABinaryStlAreReadOneAfterTheOther) {
  SurfaceMesh first = box_, second = box_;
  first.triangles.resize(5);
  second.triangles.erase(second.triangles.begin(), second.triangles.begin() + 5);
  ExpectBox(ToBinaryStl(first) + ToBinaryStl(second), "stl");
}

TEST_F(ReadVariantsTest, PlyMayHaveListsStripsAndOtherElements) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty uchar red\nproperty float x\n"
      "property float y\nproperty float z\nproperty list uchar float w\n";
  const std::string vertices = "9 0 0 0 1 7\n9 1 0 0 0\n9 0 1 0 2 7 7\n9 0 0 .18 0\n";
  ExpectBox(head +
                "element face 4\nproperty list uchar float texcoord\nproperty uchar flags\n"
                "property list uchar int vertex_index\nend_header\n" +
                vertices + "2 .5 .5 1 3 0 2 1\n0 1 3 0 1 3\n0 1 3 1 2 3\n0 1 3 2 0 3\n",
            "ply");
  ExpectBox(head +
                "element tristrips 1\nproperty list int int vertex_indices\nelement camera 1\n"
                "property float f\nend_header\n" +
                vertices + "8 0 2 1 3 0 2 -1 0\n3.5\n",
            "ply");
  EXPECT_THAT(Refused(ToTextPly(box_) + "3 0 1 2\n", "ply"),
              HasSubstr("the file goes on after the last element"));
  EXPECT_THAT(Refused(absl::StrReplaceAll(ToTextPly(box_), {{"\n3 0 ", "\n3 zero "}}), "ply"),
              HasSubstr("\"zero\" is no number"));
}

TEST_F(ReadVariantsTest, TheHeaderOfABinaryPlyMayEndItsLinesByCarriageReturns) {
  std::string ply = ToBinaryPly(box_);
  const size_t end = ply.find("end_header\n") + 11;
  std::replace(ply.begin(), ply.begin() + static_cast<ptrdiff_t>(end), '\n', '\r');
  ExpectBox(ply, "ply");
}

TEST_F(ReadVariantsTest, RegionsOfTetgenMayBeWrittenWithAPoint) {
  const std::string nodes = "5 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n";
  const NamedMesh read = ReadNamed(nodes + "2 4 1\n1 1 2 3 4 1.0\n2 2 3 4 5 2.5\n", "node");
  EXPECT_THAT(read.names.regions, ElementsAre(MeshRegion{"1", ""}, MeshRegion{"2.5", ""}));
}

// Gmsh writes an element of two physical groups twice, with different numbers.
TEST_F(ReadVariantsTest, AnElementOfTwoPhysicalGroupsIsThereOnce) {
  const std::string file =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n3 1 \"whole\"\n3 2 \"steel\"\n"
      "2 3 \"foot\"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
      "$Elements\n4\n1 2 2 3 1 1 3 2\n2 2 2 4 1 1 3 2\n3 4 2 1 1 1 2 3 4\n4 4 2 2 1 1 2 3 4\n"
      "$EndElements\n";
  const NamedMesh read = ReadNamed(file, "msh");
  EXPECT_EQ(std::get<TetMesh>(read.mesh).element_count(), 1U);
  EXPECT_THAT(GroupNames(read), ElementsAre("foot", "4", "whole", "steel"));
  for (const MeshGroup& group : read.names.groups) EXPECT_EQ(group.simplices.size(), 1U);
}

TEST_F(ReadVariantsTest, SectionsOfGmshMayHaveBlanksAndBeUnknown) {
  const TetMesh tets = SmallTetBox(4);
  for (const std::string& file : {ToTextGmsh(tets), ToTextGmsh41(tets)}) {
    ExpectSame(ReadTetsOf(absl::StrReplaceAll(
                   file, {{"$Nodes\n", "$Comments\n$Nodes\n9\n$EndComments\n$Nodes  \n"},
                          {"$Elements\n", "$Elements\t\n"}})),
               tets);
    EXPECT_THAT(Refused(absl::StrReplaceAll(file, {{"$EndNodes", "99 9 9 9\n$EndNodes"}}), "msh"),
                HasSubstr("no $EndNodes where the section says that it ends"));
  }
}

TEST_F(ReadVariantsTest, ParametricNodesOfGmshAreNodes) {
  const std::string head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n4\n";
  const std::string tail = "$EndParametricNodes\n$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n";
  const TetMesh mesh =
      ReadTetsOf(head + "1 0 0 0 0 1\n2 1 0 0 1 2 .5\n3 0 1 0 2 5 .1 .2\n4 0 0 1 3 1\n" + tail);
  EXPECT_EQ(mesh.nodes.size(), 4U);
}

}  // namespace
}  // namespace carillon::precompute
