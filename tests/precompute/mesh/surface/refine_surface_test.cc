// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/refine_surface.h"

#include <gtest/gtest.h>

#include <limits>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

TEST(RefineSurface, LeavesNoEdgeLongerThanAsked) {
  const RefinedSurface refined = RefineSurface(MakeBoxSurface({1, 0.05, 0.03}), 0.02);
  EXPECT_TRUE(CheckSurface(refined.surface).ok());
  for (size_t t = 0; t < refined.surface.triangles.size(); ++t) {
    const auto corner = CornersOf(refined.surface, t);
    for (size_t i = 0; i < 3; ++i) EXPECT_LE(Distance(corner[i], corner[(i + 1) % 3]), 0.02);
  }
}

TEST(RefineSurface, CoversEachGivenTriangleExactly) {
  const SurfaceMesh given = MakeBoxSurface({1, 0.05, 0.03});
  const RefinedSurface refined = RefineSurface(given, 0.02);
  std::vector<Point> uncovered;
  for (size_t t = 0; t < given.triangles.size(); ++t) {
    uncovered.push_back(AreaNormal(CornersOf(given, t)));
  }
  for (size_t t = 0; t < refined.surface.triangles.size(); ++t) {
    Point& rest = uncovered[static_cast<size_t>(refined.given_triangle[t])];
    rest = Difference(rest, AreaNormal(CornersOf(refined.surface, t)));
  }
  for (const Point& rest : uncovered)
    EXPECT_NEAR(Norm(rest), 0, 1e-15);  // rounding of areas <= 0.05
}

TEST(RefineSurface, CutsLongThinTrianglesAcross) {
  // 48 strips 3.3 mm wide and 505 mm long, of two triangles each. Edges of 9 mm take 61 cuts, and
  // two triangles between two cuts of a given one; the rings at both ends come to little.
  const SurfaceMesh strips = MakeTubeSurface({.around = 24, .along = 1});
  const size_t count = RefineSurface(strips, 0.009).surface.triangles.size();
  EXPECT_LT(count, 1.1 * 2 * 61 * 96);
}

TEST(RefineSurface, RefinesByTheFieldOfSizesAndEndsOnNarrowTriangles) {
  // A size that differs a lot between both sides of strips 3.3 mm wide.
  const SurfaceMesh strips = MakeTubeSurface({.around = 24, .along = 1});
  const SizeField field({{0.25, 0, 0}, {0.25, 0, 0.0125}}, {1, 0.1}, 0.5 / 0.02);
  const RefinedSurface refined = RefineSurface(strips, 0.02, field);
  EXPECT_TRUE(CheckSurface(refined.surface).ok());
  for (size_t t = 0; t < refined.surface.triangles.size(); ++t) {
    const auto corner = CornersOf(refined.surface, t);
    for (size_t i = 0; i < 3; ++i) {
      const Point &a = corner[i], &b = corner[(i + 1) % 3];
      const Point middle{(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
      EXPECT_LE(Distance(a, b), 0.02 * field.At(middle) * (1 + 1e-12));
    }
  }
}

TEST(RefineSurface, LeavesAFineSurfaceAlone) {
  const SurfaceMesh given = MakeTubeSurface({});
  const RefinedSurface refined = RefineSurface(given, std::numeric_limits<double>::infinity());
  EXPECT_EQ(refined.surface.vertices, given.vertices);
  EXPECT_EQ(refined.surface.triangles, given.triangles);
}

}  // namespace
}  // namespace carillon::precompute
