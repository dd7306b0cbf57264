// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "tests/precompute/mesh/mesh_files.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

using ReadSurfaceTest = ReadMeshTest;

struct FileOfKind {
  std::string kind;
  std::string format;
  std::string bytes;
};

std::vector<FileOfKind> EveryKind(const SurfaceMesh& surface) {
  return {{"obj", "obj", ToObj(surface)},          {"off", "off", ToOff(surface)},
          {"text ply", "ply", ToTextPly(surface)}, {"binary ply", "ply", ToBinaryPly(surface)},
          {"text stl", "stl", ToTextStl(surface)}, {"binary stl", "stl", ToBinaryStl(surface)}};
}

void ExpectSameTriangles(const SurfaceMesh& read, const SurfaceMesh& written) {
  EXPECT_EQ(read.vertices.size(), written.vertices.size());
  ASSERT_EQ(read.triangles.size(), written.triangles.size());
  for (size_t t = 0; t < read.triangles.size(); ++t) {
    const auto got = CornersOf(read, t), wanted = CornersOf(written, t);
    // Numbers pass through 24 bits: 6e-8 of coordinates up to 0.5 m.
    for (size_t i = 0; i < 3; ++i) EXPECT_LT(Distance(got[i], wanted[i]), 5e-8);
  }
}

// Files repeat vertices at seams. Each must become the same float, whatever its place in the list.
TEST_F(ReadSurfaceTest, EqualVerticesAreOneWhereverTheyStandInTheFile) {
  for (int before = 0; before < 8; ++before) {
    std::string file;
    for (int i = 0; i < before; ++i) file += "v 9 9 9\n";
    file += "v 0.1 0.2 0.3\nv 1.1 0.2 0.3\nv 0.1 1.2 0.3\nv 0.1 0.2 1.3\n";
    file += "v 0.1 0.2 0.3\nv 1.1 0.2 0.3\nv 0.1 1.2 0.3\n";
    const auto face = [&](int a, int b, int c) {
      absl::StrAppend(&file, "f ", a + before, " ", b + before, " ", c + before, "\n");
    };
    face(1, 3, 2), face(5, 6, 4), face(2, 7, 4), face(3, 1, 4);
    const NamedMesh read = ReadNamed(file, "obj");
    EXPECT_EQ(std::get<SurfaceMesh>(read.mesh).vertices.size(), 4u) << before;
    EXPECT_TRUE(CheckSurface(std::get<SurfaceMesh>(read.mesh)).ok()) << before;
  }
}

TEST_F(ReadSurfaceTest, ObjectsMaterialsAndSolidsAreRegions) {
  const NamedMesh obj = ReadNamed(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no head\nusemtl steel\nf 1 3 2\no grip\nf 1 2 4\n"
      "usemtl ash\nf 2 3 4 1\no head\nusemtl steel\nf 3 1 4\n",
      "obj");
  EXPECT_EQ(obj.names.regions,
            (std::vector<MeshRegion>{{"head", "steel"}, {"grip", "steel"}, {"grip", "ash"}}));
  EXPECT_EQ(obj.names.triangle_regions, (std::vector<int32_t>{0, 1, 2, 2, 0}));
  const std::string facet =
      "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
      "0\nendloop\nendfacet\n";
  const NamedMesh stl = ReadNamed(
      "solid the head\n" + facet + facet + "endsolid the head\nsolid \n" + facet + "endsolid\n",
      "stl");
  EXPECT_EQ(stl.names.regions, (std::vector<MeshRegion>{{"the head"}, {}}));
  EXPECT_EQ(stl.names.triangle_regions, (std::vector<int32_t>{0, 0, 1}));
}

TEST_F(ReadSurfaceTest, EveryFormatGivesTheTrianglesInTheOrderWritten) {
  const SurfaceMesh tube = MakeTubeSurface({.around = 12, .along = 10});
  for (const FileOfKind& file : EveryKind(tube)) {
    SCOPED_TRACE(file.kind);
    const SurfaceMesh read = ReadSurfaceOf(file.bytes, file.format);
    ExpectSameTriangles(read, tube);
    EXPECT_TRUE(CheckSurface(read).ok());
  }
}

TEST_F(ReadSurfaceTest, LengthsAreInMetres) {
  const NamedMesh box = ReadNamed(ToOff(MakeBoxSurface({1, 2, 4})), "off", 0.5);
  EXPECT_EQ(std::ranges::max(std::get<SurfaceMesh>(box.mesh).vertices), (Point{0.5, 1, 2}));
}

TEST_F(ReadSurfaceTest, ObjWithSplitNormalsIsOneSurface) {
  const SurfaceMesh box = MakeBoxSurface({1, 1, 1});
  std::string text = "mtllib none.mtl\nvn 0 0 1\nvt 0 0\ns 1\n";
  for (const auto& triangle : box.triangles) {
    for (const int32_t v : triangle) {
      absl::StrAppend(&text, "v ", box.vertices[static_cast<size_t>(v)][0], " ",
                      box.vertices[static_cast<size_t>(v)][1], " ",
                      box.vertices[static_cast<size_t>(v)][2], "\r\n");
    }
    absl::StrAppend(&text, "f -3/1/1 -2/1/1 \\\n-1/1/1\r\n");
  }
  ExpectSameTriangles(ReadSurfaceOf(text, "obj"), box);
}

TEST_F(ReadSurfaceTest, PolygonsBecomeTrianglesOfTheSameSurface) {
  const SurfaceMesh prism = ReadSurfaceOf(
      "OFF 10 7 0\n0 0 0\n2 0 0\n3 1 0\n1 3 0\n-1 1 0\n0 0 1\n2 0 1\n3 1 1\n1 3 1\n-1 1 1\n"
      "5 4 3 2 1 0\n5 5 6 7 8 9\n4 0 1 6 5\n4 1 2 7 6\n4 2 3 8 7\n4 3 4 9 8\n4 4 0 5 9\n",
      "off");
  EXPECT_EQ(prism.vertices.size(), 10U);
  EXPECT_EQ(prism.triangles.size(), 2U * 3U + 5U * 2U);
  EXPECT_TRUE(CheckSurface(prism).ok());
}

TEST_F(ReadSurfaceTest, PointsAndLinesAreNoTriangles) {
  const SurfaceMesh box = MakeBoxSurface({1, 1, 1});
  ExpectSameTriangles(ReadSurfaceOf(ToObj(box) + "f 1 2\nl 1 2 3\np 4\n", "obj"), box);
}

TEST_F(ReadSurfaceTest, AMissingFileIsRefused) {
  EXPECT_THAT(ReadMesh("/nonexistent/mesh.obj", "obj", 1).status().ToString(),
              HasSubstr("NOT_FOUND: FILE_NOT_FOUND: /nonexistent/mesh.obj"));
}

TEST_F(ReadSurfaceTest, AFileThatIsEmptyOrNoMeshIsRefused) {
  for (const char* format : {"obj", "off", "ply", "stl", "msh"}) {
    ExpectRefused(format, {{"", "MESH_EMPTY: "},
                           {"This is a letter.\nIt holds no mesh.\n", "MESH_UNREADABLE: "}});
  }
}

TEST_F(ReadSurfaceTest, AFileWithoutFacesIsRefused) {
  const SurfaceMesh points{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}};
  for (const FileOfKind& file : EveryKind(points)) {
    EXPECT_THAT(Refused(file.bytes, file.format), HasSubstr("MESH_EMPTY: ")) << file.kind;
  }
}

TEST_F(ReadSurfaceTest, ACoordinateThatIsNoNumberIsRefused) {
  for (const double x : {std::nan(""), HUGE_VAL}) {
    SurfaceMesh box = MakeBoxSurface({1, 1, 1});
    box.vertices[2][1] = x;
    for (const FileOfKind& file : EveryKind(box)) {
      EXPECT_THAT(Refused(file.bytes, file.format), HasSubstr("MESH_NOT_FINITE: ")) << file.kind;
    }
  }
}

TEST_F(ReadSurfaceTest, AnIndexOutOfRangeIsRefused) {
  for (const int32_t index : {8, -1, 2'000'000'000}) {
    SurfaceMesh box = MakeBoxSurface({1, 1, 1});
    box.triangles[4][1] = index;
    const std::map<std::string, std::string> files = {{"off", ToOff(box)}, {"ply", ToTextPly(box)}};
    for (const auto& [format, bytes] : files) {
      EXPECT_THAT(Refused(bytes, format), HasSubstr("MESH_INDEX_OUT_OF_RANGE: ")) << format;
    }
    EXPECT_THAT(Refused(ToBinaryPly(box), "ply"),
                AllOf(HasSubstr("MESH_INDEX_OUT_OF_RANGE: face 4 names vertex "),
                      HasSubstr(absl::StrCat(" ", index, " of 8"))));
  }
  for (const char* face : {"f 1 2 9", "f 1 2 0", "f 1 2 -9"}) {
    EXPECT_THAT(Refused(ToObj(MakeBoxSurface({1, 1, 1})) + face, "obj"),
                HasSubstr("MESH_INDEX_OUT_OF_RANGE: line 22: "))
        << face;
  }
}

TEST_F(ReadSurfaceTest, AFileThatEndsEarlyIsRefused) {
  for (const FileOfKind& file : EveryKind(MakeBoxSurface({1, 1, 1}))) {
    if (file.format == "obj") continue;  // a shorter OBJ file is one with fewer faces: open
    const std::string cut = file.bytes.substr(0, file.bytes.size() - file.bytes.size() / 7);
    const absl::StatusOr<NamedMesh> read = Read(cut, file.format);
    // Text STL has no count either: what is left must at least not pass for the whole.
    EXPECT_TRUE(!read.ok() || !CheckSurface(std::get<SurfaceMesh>(read->mesh)).ok()) << file.kind;
    if (file.kind != "text stl") {
      EXPECT_THAT(read.status().ToString(), HasSubstr("MESH_UNREADABLE: ")) << file.kind;
    }
  }
}

TEST_F(ReadSurfaceTest, APlyMayNameItsExporterWithoutAComment) {
  const SurfaceMesh tube = MakeTubeSurface({.around = 12, .along = 10});
  const std::string named = absl::StrReplaceAll(
      ToTextPly(tube), {{"format ascii 1.0\n", "format ascii 1.0\nCreated by Blender3D 247\n"}});
  ExpectSameTriangles(ReadSurfaceOf(named, "ply"), tube);
}

TEST_F(ReadSurfaceTest, BadFilesAreRefusedWithTheLine) {
  const std::string ply_head =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const std::vector<std::array<std::string, 3>> cases = {
      {"dae", "x", "MESH_FORMAT_UNKNOWN: there is no mesh format \"dae\": give obj, ply, "},
      {"obj", "v 0 0 0\nv 1 x 0\n", "line 2: \"x\" is no coordinate"},
      {"obj", "v 0 0 0\nf 1 b 3\n", "line 2: \"b\" is no vertex"},
      {"obj", "v 0 0\n", "line 1: a vertex with fewer than three"},
      {"obj", "v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "MESH_NOT_FINITE: line 1"},
      {"off", "OFF\n1 1 0\n0 0 0\n4 0 0 0\n", "line 4: a face with fewer"},
      {"off", "OFF\n4000000000 4000000000 0\n0 0 0\n", "MESH_UNREADABLE"},
      {"ply", "ply\nformat ascii 1.0\n" + ply_head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n0\n",
       "face 1 (counted from zero) names no vertices"},
      {"ply",
       "ply\nformat binary_little_endian 1.0\n" +
           absl::StrReplaceAll(ply_head, {{"vertex 3", "vertex 4000000000"}}) + "xyz",
       "MESH_UNREADABLE: line 9: the file ends within vertex 0"},
  };
  for (const auto& [format, file, message] : cases) {
    EXPECT_THAT(Refused(file, format), HasSubstr(message)) << format << ": " << file;
  }
}

TEST_F(ReadSurfaceTest, TheBunnyWhoseFilledHolesCrossItIsRefusedBeforeTheMesherCrashes) {
  const char* path = "/usr/share/glmark2/models/bunny.obj";
  ASSERT_TRUE(std::filesystem::exists(path))
      << "glmark2-data is not installed: deploy/setup.sh tests";
  const NamedMesh bunny = ReadMesh(path, "obj", 1).value();
  const auto& surface = std::get<SurfaceMesh>(bunny.mesh);
  EXPECT_EQ(surface.triangles.size(), 69'666U);
  EXPECT_EQ(surface.vertices.size(), 34'835U);
  EXPECT_THAT(CheckSurface(surface).status().ToString(), HasSubstr("MESH_SELF_INTERSECTING"));
}

TEST(ParseMesh, AGlbWhoseChunksAreLongerThanTheFileIsRefused) {
  const auto number = [](uint32_t value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  };
  const std::string header = "glTF" + number(2) + number(24);
  for (const auto& [bytes, words] :
       {std::pair{header + number(0x54000007) + "JSON{}  ", "says that it has 1409286151 bytes"},
        {header + number(4) + "JSON{}  " + number(5) + "BIN\n1234", "the chunk at byte 24"},
        {header, "the file is cut short"}}) {
    const absl::Status status = ParseMesh(bytes, "glb", 1).status();
    EXPECT_THAT(status.ToString(), AllOf(HasSubstr("MESH_UNREADABLE: "), HasSubstr(words)));
  }
}

/// The text with a byte order mark, in UTF-16.
std::string InUtf16(const std::string& ascii, bool big) {
  std::string bytes = big ? "\xFE\xFF" : "\xFF\xFE";
  for (const char c : ascii) bytes += big ? std::string{'\0', c} : std::string{c, '\0'};
  return bytes;
}

TEST(ParseMesh, TextInUtf16IsReadAsItsLetters) {
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  for (const bool big : {false, true}) {
    const NamedMesh read = ParseMesh(InUtf16(obj, big), "obj", 1).value();
    EXPECT_EQ(std::get<SurfaceMesh>(read.mesh).triangles.size(), 4U);
  }
  // Half a letter at the end is no text.
  EXPECT_FALSE(ParseMesh(InUtf16(obj, false) + "x", "obj", 1).ok());
}

}  // namespace
}  // namespace carillon::precompute
