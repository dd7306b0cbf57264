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

/// Below single precision, in which surfaces are read.
bool Near(double a, double b) { return std::abs(a - b) < 1e-6; }

bool IsFloor(const Point& p) { return Near(p[2], 0); }

class FixNodesTest : public ReadMeshTest {
 protected:
  /// Fixes nodes of a body read from a file, a surface filled with quadratic elements.
  absl::StatusOr<TetMesh> Fixed(const std::string& bytes, const std::string& format,
                                const std::vector<Fixture>& fixtures) const {
    const NamedMesh named = ReadNamed(bytes, format);
    TetMesh mesh;
    SurfaceMesh given;
    if (const auto* surface = std::get_if<SurfaceMesh>(&named.mesh)) {
      given = *surface;
      mesh = Tetrahedralize(given, {.target_node_count = 100}).value();
    } else {
      mesh = std::get<TetMesh>(named.mesh);
      given = BoundarySurface(mesh);
    }
    const absl::Status status = FixNodes(fixtures, given, named.names, mesh);
    if (!status.ok()) return status;
    return mesh;
  }

  /// Expects more than `least` nodes to be fixed: those where a condition holds, and no others.
  void ExpectFixed(const std::string& bytes, const std::string& format,
                   const std::vector<Fixture>& fixtures,
                   const std::function<bool(const Point&)>& holds, size_t least = 0) const {
    const TetMesh mesh = Fixed(bytes, format, fixtures).value();
    std::vector<int32_t> expected;
    for (size_t n = 0; n < mesh.nodes.size(); ++n) {
      if (holds(mesh.nodes[n])) expected.push_back(static_cast<int32_t>(n));
    }
    EXPECT_EQ(mesh.fixed, expected);
    EXPECT_GT(mesh.fixed.size(), least);
  }

  void ExpectRefusal(const std::string& bytes, const std::string& format,
                     const std::vector<Fixture>& fixtures, const std::string& words) const {
    EXPECT_THAT(Fixed(bytes, format, fixtures).status().ToString(), HasSubstr(words));
  }

  const std::string box_ = ToTextGmsh(MakeTetBox(kSize, {4, 2, 2}, 10));
  const SurfaceMesh surface_ = MakeBoxSurface(kSize);
};

TEST_F(FixNodesTest, PlaneHoldsWhatLiesInItAndBehindIt) {
  ExpectFixed(box_, "msh", {FixedPlane{{0, 9, 9}, {3, 0, 0}}},
              [](const Point& p) { return p[0] == 0; });
  ExpectFixed(box_, "msh", {FixedPlane{{0.5, 0, 0}, {-1, 0, 0}}},
              [](const Point& p) { return p[0] >= 0.5; });
  // A thousandth of the body's size away is away.
  ExpectRefusal(box_, "msh", {FixedPlane{{-0.001, 0, 0}, {1, 0, 0}}},
                "NO_VERTEX_FIXED: no node of the body is fixed by the plane");
}

// The reader counts the places of such a body from (4090, 0, 0).
TEST_F(FixNodesTest, RegionsOfABodyFarAwayCountFromTheOriginOfTheFile) {
  TetMesh mesh = MakeTetBox(kSize, {4, 2, 2}, 10);
  for (Point& p : mesh.nodes) p[0] += 4096;
  const std::string far_box = ToBinaryGmsh(mesh);
  ExpectFixed(far_box, "msh", {FixedPlane{{4096, 9, 9}, {3, 0, 0}}},
              [](const Point& p) { return p[0] == 6; });
  ExpectFixed(far_box, "msh", {FixedBox{{4096.5, 0, 0}, {4098, 0.25, 2}}},
              [](const Point& p) { return p[0] >= 6.5 && p[1] <= 0.25; });
}

TEST_F(FixNodesTest, BoxHoldsWhatLiesInItAndOnIt) {
  ExpectFixed(box_, "msh", {FixedBox{{0.5, 0, 0}, {2, 0.25, 2}}},
              [](const Point& p) { return p[0] >= 0.5 && p[1] <= 0.25; });
  ExpectRefusal(box_, "msh", {FixedBox{{0.1, 0.1, 0.1}, {0.11, 0.11, 0.11}}},
                "NO_VERTEX_FIXED: no node of the body is fixed by the box");
}

TEST_F(FixNodesTest, VertexHoldsItsNode) {
  for (const auto& [format, bytes] : {std::pair("obj", ToObj(surface_)),
                                      {"off", ToOff(surface_)},
                                      {"ply", ToBinaryPly(surface_)}}) {
    for (size_t v = 0; v < surface_.vertices.size(); ++v) {
      SCOPED_TRACE(format + std::to_string(v));
      const Point& at = surface_.vertices[v];
      ExpectFixed(bytes, format, {FixedVertices{{static_cast<int64_t>(v)}}}, [&](const Point& p) {
        return Near(p[0], at[0]) && Near(p[1], at[1]) && Near(p[2], at[2]);
      });
    }
  }
}

TEST_F(FixNodesTest, VerticesHoldAllOfATriangleAndAnEdgeBetweenThem) {
  std::vector<int64_t> bottom, edge;
  for (size_t v = 0; v < surface_.vertices.size(); ++v) {
    const Point& p = surface_.vertices[v];
    if (p[2] == 0) bottom.push_back(static_cast<int64_t>(v));
    if (p[2] == 0 && p[1] == 0) edge.push_back(static_cast<int64_t>(v));
  }
  ExpectFixed(ToObj(surface_), "obj", {FixedVertices{bottom}}, IsFloor, 20);
  ExpectFixed(
      ToObj(surface_), "obj", {FixedVertices{edge}},
      [](const Point& p) { return IsFloor(p) && Near(p[1], 0); }, 4);
}

TEST_F(FixNodesTest, VerticesOfTetrahedraHaveTheNumbersOfTheFile) {
  const std::string box = ToTextGmsh(MakeTetBox(kSize, {4, 2, 2}, 4));
  const TetMesh mesh = Fixed(box, "msh", {FixedVertices{{11, 20}}}).value();
  EXPECT_THAT(mesh.fixed, ::testing::ElementsAre(0, 9));
  ExpectRefusal(box, "msh", {FixedVertices{{10}}},
                "NO_VERTEX_FIXED: no node of the body is fixed by vertex 10: the numbers of "
                "the file go from 11 to 55");
  ExpectRefusal(ToBinaryStl(surface_), "stl", {FixedVertices{{0}}},
                "files of this format do not number vertices");
}

/// A box whose faces are polygons, in groups and objects.
constexpr char kGroupedObj[] =
    "v 0 0 0\nv 1 0 0\nv 1 0.5 0\nv 0 0.5 0\nv 0 0 0.25\nv 1 0 0.25\nv 1 0.5 0.25\nv 0 0.5 0.25\n"
    "o body\ng base ends\nf 1 4 3 2\ng top\nf 5 6 7 8\ng\nf 1 2 6 \\\n5\nf 3 4 8 7\n"
    "g ends\nf 2 3 7 6\nf 4 1 5 8\n";

TEST_F(FixNodesTest, GroupOfAnObjFileHoldsItsFaces) {
  ExpectFixed(kGroupedObj, "obj", {FixedGroup{"base"}}, IsFloor);
  ExpectFixed(kGroupedObj, "obj", {FixedGroup{"ends"}},
              [](const Point& p) { return IsFloor(p) || Near(p[0], 0) || Near(p[0], 1); });
  ExpectFixed(kGroupedObj, "obj", {FixedGroup{"base"}, FixedGroup{"top"}},
              [](const Point& p) { return IsFloor(p) || Near(p[2], 0.25); });
}

TEST_F(FixNodesTest, GroupThatIsNotThereIsRefusedWithThoseThatAre) {
  ExpectRefusal(kGroupedObj, "obj", {FixedGroup{"bottom"}},
                "GROUP_UNKNOWN: the mesh file has no group \"bottom\": it has \"base\", \"body\", "
                "\"ends\", \"top\"");
  ExpectRefusal(ToBinaryStl(surface_), "stl", {FixedGroup{"base"}},
                "it names none; fix a plane or a box");
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
  ExpectFixed(GmshWithABase("2\n3 7 \"body\"\n2 9 \"the base\"\n"), "msh", {FixedGroup{"the base"}},
              base);
  ExpectFixed(GmshWithABase("1\n3 7 \"body\"\n"), "msh", {FixedGroup{"9"}}, base);
  // A volume's number is a material's.
  ExpectRefusal(GmshWithABase("0\n"), "msh", {FixedGroup{"7"}}, "it has \"5\", \"9\"");
}

TEST_F(FixNodesTest, BodyFixedAllOverIsRefused) {
  const std::string box = ToTextGmsh(MakeTetBox(kSize, {2, 1, 1}, 4));
  ExpectRefusal(box, "msh",
                {FixedPlane{{0.6, 0, 0}, {1, 0, 0}}, FixedPlane{{0.6, 0, 0}, {-1, 0, 0}}},
                "ALL_VERTICES_FIXED: ");
  ExpectRefusal(box, "msh", {FixedGroup{"body"}}, "ALL_VERTICES_FIXED: ");
}

}  // namespace
}  // namespace carillon::precompute
