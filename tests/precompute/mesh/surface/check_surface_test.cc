// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/check_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "precompute/mesh/mesh_limits.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

SurfaceMesh Box() { return MakeBoxSurface({1, 1, 1}); }

std::string Refused(const SurfaceMesh& surface) {
  return CheckSurface(surface).status().ToString();
}

TEST(CheckSurface, AcceptsSolidsWithoutAWarning) {
  EXPECT_THAT(CheckSurface(Box()).value(), IsEmpty());
  EXPECT_THAT(CheckSurface(MakeTubeSurface({})).value(), IsEmpty());
  EXPECT_THAT(CheckSurface(MakeSphereSurface(0.01, 4)).value(), IsEmpty());
}

TEST(CheckSurface, AcceptsABodyInsideOutWithAWarning) {
  EXPECT_THAT(CheckSurface(InsideOut(Box())).value(), ElementsAre(HasSubstr("inside out")));
}

TEST(CheckSurface, PassesOverCollapsedTrianglesWithAWarning) {
  SurfaceMesh box = Box();
  box.triangles.push_back({0, 1, 1});
  EXPECT_THAT(CheckSurface(box).value(), ElementsAre(HasSubstr("two equal corners: 1 triangle")));
}

TEST(CheckSurface, RefusesCoordinatesThatAreNotFinite) {
  for (const double x : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    SurfaceMesh box = Box();
    box.vertices[5][1] = x;
    EXPECT_THAT(Refused(box), HasSubstr("MESH_NOT_FINITE: vertex 5"));
  }
}

TEST(CheckSurface, TellsClosedShellsThatTouchFromAShellThatIsThereTwice) {
  // Two tetrahedra that share the face 0-1-2.
  const SurfaceMesh touching{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}},
                             {{0, 2, 1},
                              {0, 1, 3},
                              {1, 2, 3},
                              {2, 0, 3},  //
                              {0, 1, 2},
                              {1, 0, 4},
                              {2, 1, 4},
                              {0, 2, 4}}};
  EXPECT_THAT(Refused(touching),
              HasSubstr("MESH_DUPLICATE_SHELL: 1 triangles lie on another with the same corners, "
                        "first triangles 0 and 4 at (0, 0, 0) m, because closed shells touch"));
  SurfaceMesh turned = Box();
  for (const auto& [a, b, c] : Box().triangles) turned.triangles.push_back({a, c, b});
  EXPECT_THAT(Refused(turned), HasSubstr("keep one shell of those that are there twice"));
}

TEST(CheckSurface, RefusesAnEdgeOfFourTriangles) {
  // Two tetrahedra that share the edge 0-1 only.
  const SurfaceMesh touching{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {0, 0, -1}},
      {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 4, 1}, {0, 1, 5}, {1, 4, 5}, {4, 0, 5}}};
  EXPECT_THAT(Refused(touching), HasSubstr("MESH_NOT_MANIFOLD: 1 edges have more than two"));
}

TEST(CheckSurface, RefusesTetrahedraThatTouchAtOneVertex) {
  SurfaceMesh touching{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
      {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  for (const auto& t : {std::array{0, 4, 5}, {0, 6, 4}, {4, 6, 5}, {5, 6, 0}}) {
    touching.triangles.push_back(t);
  }
  EXPECT_FALSE(CheckSurface(touching).ok());
}

TEST(CheckSurface, RefusesATriangleOfThreeCornersOnOneLine) {
  // A box, one of whose edges has a vertex in its middle that only a flat triangle uses.
  SurfaceMesh box = Box();
  const auto [a, b, c] = box.triangles[0];
  const Point p = box.vertices[static_cast<size_t>(a)], q = box.vertices[static_cast<size_t>(b)];
  const auto middle = static_cast<int32_t>(box.vertices.size());
  box.vertices.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
  box.triangles[0] = {a, middle, c};
  box.triangles.push_back({middle, b, c});
  box.triangles.push_back({a, b, middle});
  EXPECT_THAT(Refused(box), HasSubstr("MESH_DEGENERATE_TRIANGLE: triangle 13"));
}

}  // namespace
}  // namespace carillon::precompute
