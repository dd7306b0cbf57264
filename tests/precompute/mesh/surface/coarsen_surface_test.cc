// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/coarsen_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/mesh/surface/refine_surface.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

SurfaceMesh FineSphere() { return MakeSphereSurface(0.1, 6); }

TEST(CoarsenSurface, ASphereKeepsItsVolume) {
  const SurfaceMesh fine = FineSphere();
  ASSERT_GT(fine.triangles.size(), kMaxUncoarsenedTriangles);
  const std::optional<CoarsenedSurface> coarse = CoarsenSurface(fine, 0);
  ASSERT_TRUE(coarse.has_value());
  EXPECT_LT(coarse->surface.triangles.size(), fine.triangles.size() / 2);
  EXPECT_NEAR(EnclosedVolume(coarse->surface) / EnclosedVolume(fine), 1, 5e-4);
  EXPECT_GT(coarse->frequency_error, 0);
  EXPECT_LT(coarse->frequency_error, 0.002);
  EXPECT_TRUE(CheckSurface(coarse->surface).ok());
  const std::optional<CoarsenedSurface> few = CoarsenSurface(fine, 3000);
  ASSERT_TRUE(few.has_value());
  EXPECT_LT(few->surface.triangles.size(), 4000);
  EXPECT_LT(few->surface.triangles.size(), coarse->surface.triangles.size());
}

TEST(CoarsenSurface, ABoxKeepsItsEdges) {
  const SurfaceMesh fine = RefineSurface(MakeBoxSurface({0.3, 0.2, 0.1}), 0.003).surface;
  ASSERT_GT(fine.triangles.size(), kMaxUncoarsenedTriangles);
  const std::optional<CoarsenedSurface> coarse = CoarsenSurface(fine, 0);
  ASSERT_TRUE(coarse.has_value());
  EXPECT_NEAR(EnclosedVolume(coarse->surface), 0.3 * 0.2 * 0.1, 1e-9);
  EXPECT_LT(coarse->frequency_error, 1e-6);
}

TEST(CoarsenSurface, LeavesASurfaceOfFewTrianglesAlone) {
  EXPECT_FALSE(CoarsenSurface(MakeSphereSurface(0.1, 4), 0).has_value());
}

/// A cylinder of 60 by 100 mm with a fan of triangles at each end.
SurfaceMesh Cylinder(int facets) {
  SurfaceMesh surface;
  for (const double z : {0.0, 0.1}) {
    for (int i = 0; i < facets; ++i) {
      const double angle = 2 * std::numbers::pi * i / facets;
      surface.vertices.push_back({0.03 * std::cos(angle), 0.03 * std::sin(angle), z});
    }
  }
  for (int i = 0; i < facets; ++i) {
    const int j = (i + 1) % facets;
    surface.triangles.push_back({i, j, facets + j});
    surface.triangles.push_back({i, facets + j, facets + i});
    if (i == 0 || j == 0) continue;
    surface.triangles.push_back({0, j, i});
    surface.triangles.push_back({facets, facets + i, facets + j});
  }
  return surface;
}

// TetGen gave up on such a body after minutes.
TEST(CoarsenSurface, ACylinderOfManyFacetsGetsTrianglesThatAreWiderThanAFacet) {
  const SurfaceMesh fine = Cylinder(300);
  ASSERT_TRUE(CheckSurface(fine).ok());
  const std::optional<CoarsenedSurface> coarse = CoarsenSurface(fine, 0);
  ASSERT_TRUE(coarse.has_value());
  EXPECT_LT(coarse->surface.triangles.size(), 6000);
  EXPECT_NEAR(EnclosedVolume(coarse->surface) / EnclosedVolume(fine), 1, 3e-3);
  EXPECT_LT(coarse->frequency_error, 0.003);
  EXPECT_TRUE(CheckSurface(coarse->surface).ok());
  EXPECT_FALSE(CoarsenSurface(Cylinder(60), 0).has_value());
}

TEST(CoarsenSurface, LeavesAFoilAloneWhoseFormItWouldChange) {
  // A wall of 0.2 mm, whose folds of 2 mm would be cut off.
  SurfaceMesh foil = RefineSurface(MakeBoxSurface({0.1, 0.1, 0.0002}), 0.0011).surface;
  ASSERT_GT(foil.triangles.size(), kMaxUncoarsenedTriangles);
  for (Point& p : foil.vertices) p[2] += 0.002 * std::sin(p[0] * 2 * std::numbers::pi / 0.006);
  EXPECT_FALSE(CoarsenSurface(foil, 0).has_value());
}

TEST(CoarsenSurface, EachTriangleNamesTheGivenOneBeneathIt) {
  const SurfaceMesh fine = FineSphere();
  const PreparedSurface prepared = PrepareSurface(fine, {.coarsen = true}).value();
  ASSERT_EQ(prepared.given_triangle.size(), prepared.surface.triangles.size());
  EXPECT_EQ(prepared.warnings.size(), 1U);
  EXPECT_GT(prepared.frequency_error, 0);
  for (size_t t = 0; t < prepared.given_triangle.size(); ++t) {
    const auto given = static_cast<size_t>(prepared.given_triangle[t]);
    EXPECT_LT(Distance(MiddleOf(CornersOf(prepared.surface, t)), MiddleOf(CornersOf(fine, given))),
              0.005);
  }
}

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
