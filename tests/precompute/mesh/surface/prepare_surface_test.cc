// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/prepare_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "precompute/mesh/point_math.h"
#include "proto/cpp/error_reason.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

/// Puts a triangle of size `depth_m`, turned by half a turn, into a triangle of the surface, so
/// that the triangles between both cross one another. Returns where.
Point FoldIn(SurfaceMesh& surface, double depth_m) {
  const auto given = surface.triangles[10];
  const auto corners = CornersOf(surface, 10);
  const Point normal = AreaNormal(corners);
  const Point center = MiddleOf(corners);
  std::array<int32_t, 3> turned{};
  const std::array<double, 3> heights{0.5, -1, 1};  // so that no two planes are parallel
  for (size_t k = 0; k < 3; ++k) {
    Point p = center;
    for (size_t i = 0; i < 3; ++i) {
      p[i] -= depth_m * (corners[k][i] - center[i]) / Distance(corners[k], center);
      p[i] += depth_m * heights[k] * normal[i] / Norm(normal);
    }
    turned[k] = static_cast<int32_t>(surface.vertices.size());
    surface.vertices.push_back(p);
  }
  surface.triangles[10] = turned;
  for (size_t k = 0; k < 3; ++k) {
    const size_t next = (k + 1) % 3;
    surface.triangles.push_back({given[k], given[next], turned[k]});
    surface.triangles.push_back({given[next], turned[next], turned[k]});
  }
  return center;
}

TEST(PrepareSurface, ASoundSurfaceStaysAsItIs) {
  const SurfaceMesh box = MakeBoxSurface({1, 0.5, 0.3});
  const auto prepared = PrepareSurface(box, {.repair = true}).value();
  EXPECT_EQ(prepared.surface.triangles, box.triangles);
  EXPECT_EQ(prepared.given_triangle.back(), 11);
  EXPECT_TRUE(prepared.warnings.empty());
}

TEST(PrepareSurface, ABallHollowedOutHasTheVolumeOfItsShellAndNamesItsOwnTriangles) {
  const SurfaceMesh ball = MakeSphereSurface(0.1, 4);
  const auto hollow = PrepareSurface(ball, {.wall_m = 0.02}).value();
  // The polyhedron of 2048 triangles has 0.5 % less than the ball.
  const double shell = 4 * kPi / 3 * (std::pow(0.1, 3) - std::pow(0.08, 3));
  EXPECT_NEAR(EnclosedVolume(hollow.surface), shell, 0.01 * shell);
  for (size_t t = 0; t < ball.triangles.size(); ++t) {
    EXPECT_EQ(hollow.given_triangle[t], static_cast<int32_t>(t));
  }
  // What lies inside is under the triangle it names.
  for (size_t t = ball.triangles.size(); t < hollow.surface.triangles.size(); t += 97) {
    const auto inner = CornersOf(hollow.surface, t);
    const auto outer = CornersOf(ball, static_cast<size_t>(hollow.given_triangle[t]));
    EXPECT_NEAR(Distance(inner[0], outer[0]), 0.02, 0.02);
  }
}

TEST(PrepareSurface, AnOpenSheetGetsAThickness) {
  SurfaceMesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.2, 0, 0}, {0.2, 0.1, 0}, {0, 0.1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_THAT(PrepareSurface(sheet, {}).status().ToString(), HasSubstr("MESH_NOT_CLOSED"));
  const auto thick = PrepareSurface(sheet, {.wall_m = 0.01}).value();
  // A slab with a round edge, a half cylinder of radius 5 mm, and quarter balls at the corners.
  const double slab = 0.2 * 0.1 * 0.01 + 0.6 * kPi / 2 * 25e-6 + 4 * kPi / 3 * 125e-9;
  EXPECT_NEAR(EnclosedVolume(thick.surface), slab, 0.02 * slab);
}

TEST(PrepareSurface, AnImpossibleWallIsRefusedWithFigures) {
  const SurfaceMesh box = MakeBoxSurface({0.2, 0.03, 0.02});
  for (const double wall_m : {0.011, 0.3, 1e-6}) {
    EXPECT_THAT(PrepareSurface(box, {.wall_m = wall_m}).status().ToString(),
                HasSubstr("MESH_WALL_IMPOSSIBLE"))
        << wall_m;
  }
}

TEST(PrepareSurface, BodiesThatCrossAreUnitedByAWrap) {
  SurfaceMesh cross = MakeBoxSurface({0.2, 0.05, 0.05});
  AddShell(cross, MakeBoxSurface({0.05, 0.2, 0.05}), {0.075, -0.075, 0});
  const auto united = PrepareSurface(cross, {.repair = true}).value();
  const double volume = 0.05 * 0.05 * (0.2 + 0.2 - 0.05);
  EXPECT_NEAR(EnclosedVolume(united.surface), volume, 0.01 * volume);
  ASSERT_EQ(united.warnings.size(), 2U);
  EXPECT_THAT(united.warnings[0], HasSubstr("wrapped"));
  // The wrap may be made as coarse as a sound body.
  const auto coarse = PrepareSurface(cross, {.repair = true, .coarsen = true}).value();
  EXPECT_LT(5 * coarse.surface.triangles.size(), united.surface.triangles.size());
  EXPECT_NEAR(EnclosedVolume(coarse.surface) / EnclosedVolume(united.surface), 1, 0.01);
  EXPECT_GT(coarse.frequency_error, 0);
  EXPECT_LE(coarse.frequency_error, 0.01);
}

TEST(PrepareSurface, AWideHoleIsFilledWhereItIs) {
  const SurfaceMesh ball = MakeSphereSurface(0.1, 3);
  SurfaceMesh open = ball;
  std::erase_if(open.triangles, [&](const auto& triangle) {
    return std::ranges::all_of(triangle, [&](int32_t v) {
      return Distance(ball.vertices[static_cast<size_t>(v)], ball.vertices[0]) < 0.045;
    });
  });
  ASSERT_LT(open.triangles.size(), ball.triangles.size());
  const auto filled = PrepareSurface(open, {.repair = true}).value();
  EXPECT_NEAR(EnclosedVolume(filled.surface), EnclosedVolume(ball), 0.01 * EnclosedVolume(ball));
  EXPECT_THAT(filled.warnings[0], HasSubstr("holes filled with smooth patches"));
  // The repaired surface has kept the given vertices.
  for (size_t v = 0; v < open.vertices.size(); v += 7) {
    bool used = false;
    for (const auto& triangle : open.triangles) {
      used |= std::ranges::count(triangle, static_cast<int32_t>(v)) > 0;
    }
    if (!used) continue;
    const auto& kept = filled.surface.vertices;
    EXPECT_TRUE(std::ranges::any_of(
        kept, [&](const Point& p) { return Distance(p, open.vertices[v]) < 1e-9; }));
  }
}

/// A vessel whose mouth is as wide as itself.
SurfaceMesh OpenCup() {
  SurfaceMesh cup = MakeBoxSurface({0.1, 0.1, 0.2});
  std::erase_if(cup.triangles, [&](const auto& triangle) {
    return std::ranges::all_of(
        triangle, [&](int32_t v) { return cup.vertices[static_cast<size_t>(v)][2] > 0.19; });
  });
  return cup;
}

TEST(PrepareSurface, AHoleInAFlatFaceIsClosedWhateverItsSize) {
  const SurfaceMesh box = MakeBoxSurface({0.1, 0.08, 0.06});
  for (size_t lacking = 0; lacking < box.triangles.size(); ++lacking) {
    SurfaceMesh open = box;
    open.triangles.erase(open.triangles.begin() + static_cast<std::ptrdiff_t>(lacking));
    const auto closed = PrepareSurface(open, {.repair = true}).value();
    EXPECT_NEAR(EnclosedVolume(closed.surface), 0.1 * 0.08 * 0.06, 1e-10);
    EXPECT_THAT(closed.warnings[0], HasSubstr("in the plane of the face"));
    EXPECT_THAT(closed.warnings[1], HasSubstr("errors are those of the repaired body"));
  }
}

TEST(PrepareSurface, AVesselIsNotFilledThroughItsMouthWhoseWidthIsNamed) {
  EXPECT_THAT(
      PrepareSurface(OpenCup(), {.repair = true}).status().ToString(),
      AllOf(HasSubstr("MESH_NOT_CLOSED"), HasSubstr("the surface has a hole about 0.1 m wide")));
}

TEST(PrepareSurface, AFoldIsUntangledWhereItIs) {
  SurfaceMesh ball = MakeSphereSurface(0.1, 5);
  const double volume = EnclosedVolume(ball);
  const Point fold = FoldIn(ball, 3e-6);
  EXPECT_THAT(PrepareSurface(ball, {}).status().ToString(), HasSubstr("MESH_SELF_INTERSECTING"));
  const auto untangled = PrepareSurface(ball, {.repair = true}).value();
  EXPECT_NEAR(EnclosedVolume(untangled.surface), volume, 1e-4 * volume);
  EXPECT_THAT(untangled.warnings[0], HasSubstr("were replaced"));
  // Far from the fold nothing has changed.
  int moved = 0;
  for (const Point& p : ball.vertices) {
    if (Distance(p, fold) < 0.05) continue;
    moved += std::ranges::count(untangled.surface.vertices, p) == 0 ? 1 : 0;
  }
  EXPECT_EQ(moved, 0);
}

/// A tube of 0.1 m with a wall of 4 mm, with a hole and a slit from its end through both sides.
SurfaceMesh CrackedTube() {
  constexpr int kAround = 48;
  SurfaceMesh tube = MakeTubeSurface(
      {.outer_radius_m = 0.05, .wall_m = 0.004, .length_m = 0.1, .around = kAround, .along = 12});
  std::vector<std::array<int32_t, 3>> kept;
  for (size_t t = 0; t < tube.triangles.size(); ++t) {
    const Point p = MiddleOf(CornersOf(tube, t));
    const double turn = std::atan2(p[1], p[0]) * kAround / (2 * kPi);
    const bool in_hole = turn > 0 && turn < 4 && p[2] > 0.04 && p[2] < 0.06;
    const bool in_slit = turn > 20 && turn < 21 && p[2] > 0.04;
    if (!in_hole && !in_slit) kept.push_back(tube.triangles[t]);
  }
  tube.triangles = kept;
  return tube;
}

TEST(PrepareSurface, AWallIsNotAdvisedAndRefusedWhereTheSurfaceHasTwoSides) {
  const SurfaceMesh tube = CrackedTube();
  const absl::Status open = PrepareSurface(tube, {}).status();
  EXPECT_THAT(open.ToString(), HasSubstr("MESH_NOT_CLOSED"));
  EXPECT_EQ(ToErrorInfo(open).metadata().at("wall_helps"), "0");
  const absl::Status repaired = PrepareSurface(tube, {.repair = true}).status();
  EXPECT_EQ(ToErrorInfo(repaired).metadata().at("wall_helps"), "0") << repaired;
  EXPECT_THAT(PrepareSurface(tube, {.wall_m = 0.0028}).status().ToString(),
              HasSubstr("has both sides of its wall already"));
}

TEST(PrepareSurface, AFailedRepairNamesTheFirstFaultToo) {
  SurfaceMesh cup = OpenCup();
  cup.triangles.push_back(cup.triangles[0]);
  const absl::Status failed = PrepareSurface(cup, {.repair = true}).status();
  EXPECT_THAT(failed.ToString(),
              AllOf(HasSubstr("MESH_NOT_CLOSED"), HasSubstr("MESH_DUPLICATE_SHELL: ")));
  EXPECT_EQ(ToErrorInfo(failed).metadata().at("given_reason"), "MESH_DUPLICATE_SHELL");
}

}  // namespace
}  // namespace carillon::precompute
