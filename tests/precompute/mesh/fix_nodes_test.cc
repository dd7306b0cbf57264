// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fix_nodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "tests/precompute/mesh/mesh_files.h"
#include "tests/precompute/mesh/read_mesh_fixture.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

constexpr Point kSize{1, 0.5, 0.25};

/// Nodes of a mesh where a condition holds.
std::vector<int32_t> NodesWhere(const TetMesh& mesh,
                                const std::function<bool(const Point&)>& holds) {
  std::vector<int32_t> nodes;
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (holds(mesh.nodes[n])) nodes.push_back(static_cast<int32_t>(n));
  }
  return nodes;
}

/// Below single precision, in which surfaces are read.
bool Near(double a, double b) { return std::abs(a - b) < 1e-6; }

class FixNodesTest : public ReadMeshTest {
 protected:
  /// The nodes fixed of a body read from a file, a surface filled with quadratic elements.
  TetMesh Fixed(const std::string& bytes, const std::string& format,
                const std::vector<Fixture>& fixtures) {
    absl::StatusOr<NamedMesh> named = ReadNamed(bytes, format);
    EXPECT_TRUE(named.ok()) << named.status();
    TetMesh mesh;
    SurfaceMesh given;
    if (auto* surface = std::get_if<SurfaceMesh>(&named->mesh)) {
      given = *surface;
      mesh = Tetrahedralize(given, {.target_node_count = 100}).value();
    } else {
      mesh = std::get<TetMesh>(named->mesh);
      given = BoundarySurface(mesh);
    }
    status = FixNodes(fixtures, given, named->names, mesh);
    return mesh;
  }

  absl::Status status;
};

TEST_F(FixNodesTest, PlaneHoldsWhatLiesInItAndBehindIt) {
  const std::string box = ToTextGmsh(MakeTetBox(kSize, {4, 2, 2}, 10));
  const TetMesh face = Fixed(box, "msh", {FixedPlane{{0, 9, 9}, {3, 0, 0}}});
  EXPECT_EQ(face.fixed, NodesWhere(face, [](const Point& p) { return p[0] == 0; }));
  const TetMesh half = Fixed(box, "msh", {FixedPlane{{0.5, 0, 0}, {-1, 0, 0}}});
  EXPECT_EQ(half.fixed, NodesWhere(half, [](const Point& p) { return p[0] >= 0.5; }));
  // A thousandth of the body's size away is away.
  Fixed(box, "msh", {FixedPlane{{-0.001, 0, 0}, {1, 0, 0}}});
  EXPECT_THAT(status.ToString(),
              HasSubstr("NO_VERTEX_FIXED: no node of the body is fixed by the plane"));
}

// The reader counts the places of such a body from (4090, 0, 0).
TEST_F(FixNodesTest, RegionsOfABodyFarAwayCountFromTheOriginOfTheFile) {
  TetMesh far_box = MakeTetBox(kSize, {4, 2, 2}, 10);
  for (Point& p : far_box.nodes) p[0] += 4096;
  const TetMesh face = Fixed(ToBinaryGmsh(far_box), "msh", {FixedPlane{{4096, 9, 9}, {3, 0, 0}}});
  EXPECT_THAT(face.fixed, ::testing::Not(::testing::IsEmpty()));
  EXPECT_EQ(face.fixed, NodesWhere(face, [](const Point& p) { return p[0] == 6; }));
  const TetMesh part =
      Fixed(ToBinaryGmsh(far_box), "msh", {FixedBox{{4096.5, 0, 0}, {4098, 0.25, 2}}});
  EXPECT_EQ(part.fixed,
            NodesWhere(part, [](const Point& p) { return p[0] >= 6.5 && p[1] <= 0.25; }));
}

TEST_F(FixNodesTest, BoxHoldsWhatLiesInItAndOnIt) {
  const std::string box = ToTextGmsh(MakeTetBox(kSize, {4, 2, 2}, 10));
  const TetMesh mesh = Fixed(box, "msh", {FixedBox{{0.5, 0, 0}, {2, 0.25, 2}}});
  EXPECT_EQ(mesh.fixed,
            NodesWhere(mesh, [](const Point& p) { return p[0] >= 0.5 && p[1] <= 0.25; }));
  Fixed(box, "msh", {FixedBox{{0.1, 0.1, 0.1}, {0.11, 0.11, 0.11}}});
  EXPECT_THAT(status.ToString(),
              HasSubstr("NO_VERTEX_FIXED: no node of the body is fixed by the box"));
}

TEST_F(FixNodesTest, VertexHoldsItsNode) {
  for (const char* format : {"obj", "off", "ply"}) {
    const SurfaceMesh surface = MakeBoxSurface(kSize);
    const std::string bytes = std::string(format) == "obj"   ? ToObj(surface)
                              : std::string(format) == "off" ? ToOff(surface)
                                                             : ToBinaryPly(surface);
    for (size_t v = 0; v < surface.vertices.size(); ++v) {
      const Point& at = surface.vertices[v];
      const TetMesh mesh = Fixed(bytes, format, {FixedVertices{{static_cast<int64_t>(v)}}});
      ASSERT_TRUE(status.ok()) << status;
      EXPECT_EQ(mesh.fixed, NodesWhere(mesh,
                                       [&](const Point& p) {
                                         return Near(p[0], at[0]) && Near(p[1], at[1]) &&
                                                Near(p[2], at[2]);
                                       }))
          << format << v;
    }
  }
}

TEST_F(FixNodesTest, VerticesHoldAllOfATriangleAndAnEdgeBetweenThem) {
  const SurfaceMesh surface = MakeBoxSurface(kSize);
  std::vector<int64_t> bottom, edge;
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    const Point& p = surface.vertices[v];
    if (p[2] == 0) bottom.push_back(static_cast<int64_t>(v));
    if (p[2] == 0 && p[1] == 0) edge.push_back(static_cast<int64_t>(v));
  }
  const TetMesh face = Fixed(ToObj(surface), "obj", {FixedVertices{bottom}});
  EXPECT_EQ(face.fixed, NodesWhere(face, [](const Point& p) { return Near(p[2], 0); }));
  EXPECT_GT(face.fixed.size(), 20u);
  const TetMesh line = Fixed(ToObj(surface), "obj", {FixedVertices{edge}});
  EXPECT_EQ(line.fixed,
            NodesWhere(line, [](const Point& p) { return Near(p[2], 0) && Near(p[1], 0); }));
  EXPECT_GT(line.fixed.size(), 4u);
}

TEST_F(FixNodesTest, VerticesOfTetrahedraHaveTheNumbersOfTheFile) {
  const TetMesh box = MakeTetBox(kSize, {4, 2, 2}, 4);
  const TetMesh mesh = Fixed(ToTextGmsh(box), "msh", {FixedVertices{{11, 20}}});
  EXPECT_THAT(mesh.fixed, ::testing::ElementsAre(0, 9));
  Fixed(ToTextGmsh(box), "msh", {FixedVertices{{10}}});
  EXPECT_THAT(
      status.ToString(),
      HasSubstr("NO_VERTEX_FIXED: no node of the body is fixed by vertex 10: the numbers of "
                "the file go from 11 to 55"));
}

TEST_F(FixNodesTest, VerticesOfAFormatThatNumbersNoneAreRefused) {
  Fixed(ToBinaryStl(MakeBoxSurface(kSize)), "stl", {FixedVertices{{0}}});
  EXPECT_THAT(status.ToString(), HasSubstr("files of this format do not number vertices"));
}

/// A box whose faces are polygons, in groups and objects.
constexpr char kGroupedObj[] =
    "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0 0.5 0\nv 0 0 0.25\nv 1 0 0.25\nv 1 0.5 0.25\nv 0 0.5 0.25\n"
    "o body\ng base ends\nf 1 4 3 2\ng top\nf 5 6 7 8\ng\nf 1 2 6 \\\n5\nf 3 4 8 7\n"
    "g ends\nf 2 3 7 6\nf 4 1 5 8\n";

TEST_F(FixNodesTest, GroupOfAnObjFileHoldsItsFaces) {
  const TetMesh base = Fixed(kGroupedObj, "obj", {FixedGroup{"base"}});
  EXPECT_EQ(base.fixed, NodesWhere(base, [](const Point& p) { return Near(p[2], 0); }));
  const TetMesh ends = Fixed(kGroupedObj, "obj", {FixedGroup{"ends"}});
  EXPECT_EQ(ends.fixed, NodesWhere(ends, [](const Point& p) {
              return Near(p[2], 0) || Near(p[0], 0) || Near(p[0], 1);
            }));
  const TetMesh both = Fixed(kGroupedObj, "obj", {FixedGroup{"base"}, FixedGroup{"top"}});
  EXPECT_EQ(both.fixed,
            NodesWhere(both, [](const Point& p) { return Near(p[2], 0) || Near(p[2], 0.25); }));
}

TEST_F(FixNodesTest, GroupThatIsNotThereIsRefusedWithThoseThatAre) {
  Fixed(kGroupedObj, "obj", {FixedGroup{"bottom"}});
  EXPECT_THAT(status.ToString(), HasSubstr("GROUP_UNKNOWN: the mesh file has no group \"bottom\": "
                                           "it has \"base\", \"body\", \"ends\", \"top\""));
  Fixed(ToBinaryStl(MakeBoxSurface(kSize)), "stl", {FixedGroup{"base"}});
  EXPECT_THAT(status.ToString(), HasSubstr("it names none; fix a plane or a box"));
}

/// A box of ten-node tetrahedra, of which the triangles at z = 0 have a physical group of this tag.
std::string GmshWithABase(const std::string& physical_names) {
  const TetMesh box = MakeTetBox(kSize, {3, 2, 1}, 10);
  std::string text = ToTextGmsh(box);
  text.replace(text.find("1\n3 7 \"body\"\n"), 13, physical_names);
  size_t at = text.find("$Elements\n");
  for (const BoundaryFace& face : box.boundary) {
    at = text.find(" 2 2 5 6 ", at + 1);
    bool in_base = true;
    for (const int32_t node : face.nodes) in_base &= box.nodes[static_cast<size_t>(node)][2] == 0;
    if (in_base) text.replace(at, 9, " 2 2 9 6 ");
  }
  return text;
}

TEST_F(FixNodesTest, PhysicalGroupHoldsItsElementsWithTheirMidsideNodes) {
  const auto base = [](const Point& p) { return p[2] == 0; };
  const TetMesh named =
      Fixed(GmshWithABase("2\n3 7 \"body\"\n2 9 \"the base\"\n"), "msh", {FixedGroup{"the base"}});
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(named.fixed, NodesWhere(named, base));
  const TetMesh numbered = Fixed(GmshWithABase("1\n3 7 \"body\"\n"), "msh", {FixedGroup{"9"}});
  EXPECT_EQ(numbered.fixed, NodesWhere(numbered, base));
  Fixed(GmshWithABase("0\n"), "msh", {FixedGroup{"7"}});
  EXPECT_THAT(status.ToString(), HasSubstr("it has \"5\", \"9\""))
      << "a volume's number is a material's";
}

TEST_F(FixNodesTest, BodyFixedAllOverIsRefused) {
  const std::string box = ToTextGmsh(MakeTetBox(kSize, {2, 1, 1}, 4));
  Fixed(box, "msh", {FixedPlane{{0.6, 0, 0}, {1, 0, 0}}, FixedPlane{{0.6, 0, 0}, {-1, 0, 0}}});
  EXPECT_THAT(status.ToString(), HasSubstr("ALL_VERTICES_FIXED: "));
  Fixed(box, "msh", {FixedGroup{"body"}});
  EXPECT_THAT(status.ToString(), HasSubstr("ALL_VERTICES_FIXED: "));
}

}  // namespace
}  // namespace carillon::precompute
