// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/prepare_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/make_wall.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "precompute/mesh/surface/wrap_surface.h"
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
  Point center{};
  for (const Point& corner : corners) {
    for (size_t i = 0; i < 3; ++i) center[i] += corner[i] / 3;
  }
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
  const auto prepared = PrepareSurface(box, {.repair = true});
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  EXPECT_EQ(prepared->surface.triangles, box.triangles);
  EXPECT_EQ(prepared->given_triangle.back(), 11);
  EXPECT_TRUE(prepared->warnings.empty());
}

TEST(PrepareSurface, WithoutRepairAFaultIsRefused) {
  SurfaceMesh box = MakeBoxSurface({1, 0.5, 0.3});
  std::swap(box.triangles[3][0], box.triangles[3][1]);
  EXPECT_THAT(PrepareSurface(box, {}).status().ToString(), HasSubstr("MESH_NOT_ORIENTED"));
  const auto repaired = PrepareSurface(box, {.repair = true});
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_NEAR(EnclosedVolume(repaired->surface), 0.15, 1e-12);
  EXPECT_EQ(repaired->given_triangle[3], 3);
}

TEST(PrepareSurface, ABallHollowedOutHasTheVolumeOfItsShellAndNamesItsOwnTriangles) {
  const SurfaceMesh ball = MakeSphereSurface(0.1, 4);
  const auto hollow = PrepareSurface(ball, {.wall_m = 0.02});
  ASSERT_TRUE(hollow.ok()) << hollow.status();
  // The polyhedron of 2048 triangles has 0.5 % less than the ball.
  const double shell = 4 * kPi / 3 * (std::pow(0.1, 3) - std::pow(0.08, 3));
  EXPECT_NEAR(EnclosedVolume(hollow->surface), shell, 0.01 * shell);
  for (size_t t = 0; t < ball.triangles.size(); ++t) {
    EXPECT_EQ(hollow->given_triangle[t], static_cast<int32_t>(t));
  }
  // What lies inside is under the triangle it names.
  for (size_t t = ball.triangles.size(); t < hollow->surface.triangles.size(); t += 97) {
    const auto inner = CornersOf(hollow->surface, t);
    const auto outer = CornersOf(ball, static_cast<size_t>(hollow->given_triangle[t]));
    EXPECT_NEAR(Distance(inner[0], outer[0]), 0.02, 0.02);
  }
}

TEST(PrepareSurface, AnOpenSheetGetsAThickness) {
  SurfaceMesh sheet;
  sheet.vertices = {{0, 0, 0}, {0.2, 0, 0}, {0.2, 0.1, 0}, {0, 0.1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_THAT(PrepareSurface(sheet, {}).status().ToString(), HasSubstr("MESH_NOT_CLOSED"));
  const auto thick = PrepareSurface(sheet, {.wall_m = 0.01});
  ASSERT_TRUE(thick.ok()) << thick.status();
  // A slab with a round edge, a half cylinder of radius 5 mm, and quarter balls at the corners.
  const double slab = 0.2 * 0.1 * 0.01 + 0.6 * kPi / 2 * 25e-6 + 4 * kPi / 3 * 125e-9;
  EXPECT_NEAR(EnclosedVolume(thick->surface), slab, 0.02 * slab);
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
  const auto united = PrepareSurface(cross, {.repair = true});
  ASSERT_TRUE(united.ok()) << united.status();
  const double volume = 0.05 * 0.05 * (0.2 + 0.2 - 0.05);
  EXPECT_NEAR(EnclosedVolume(united->surface), volume, 0.01 * volume);
  ASSERT_EQ(united->warnings.size(), 2U);
  EXPECT_THAT(united->warnings[0], HasSubstr("wrapped"));
}

TEST(PrepareSurface, AWrapMayBeMadeAsCoarseAsASoundBody) {
  SurfaceMesh cross = MakeBoxSurface({0.2, 0.05, 0.05});
  AddShell(cross, MakeBoxSurface({0.05, 0.2, 0.05}), {0.075, -0.075, 0});
  const auto fine = PrepareSurface(cross, {.repair = true});
  const auto coarse = PrepareSurface(cross, {.repair = true, .coarsen = true});
  ASSERT_TRUE(fine.ok() && coarse.ok()) << coarse.status();
  EXPECT_LT(5 * coarse->surface.triangles.size(), fine->surface.triangles.size());
  EXPECT_NEAR(EnclosedVolume(coarse->surface) / EnclosedVolume(fine->surface), 1, 0.01);
  EXPECT_GT(coarse->frequency_error, 0);
  EXPECT_LE(coarse->frequency_error, 0.01);
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
  const auto filled = PrepareSurface(open, {.repair = true});
  ASSERT_TRUE(filled.ok()) << filled.status();
  EXPECT_NEAR(EnclosedVolume(filled->surface), EnclosedVolume(ball), 0.01 * EnclosedVolume(ball));
  EXPECT_THAT(filled->warnings[0], HasSubstr("holes filled with smooth patches"));
  // The repaired surface has kept the given vertices.
  for (size_t v = 0; v < open.vertices.size(); v += 7) {
    bool used = false;
    for (const auto& triangle : open.triangles) {
      used |= std::ranges::count(triangle, static_cast<int32_t>(v)) > 0;
    }
    if (!used) continue;
    const auto& kept = filled->surface.vertices;
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
    const auto closed = PrepareSurface(open, {.repair = true});
    ASSERT_TRUE(closed.ok()) << closed.status();
    EXPECT_NEAR(EnclosedVolume(closed->surface), 0.1 * 0.08 * 0.06, 1e-10);
    EXPECT_THAT(closed->warnings[0], HasSubstr("in the plane of the face"));
    EXPECT_THAT(closed->warnings[1], HasSubstr("errors are those of the repaired body"));
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
  const auto untangled = PrepareSurface(ball, {.repair = true});
  ASSERT_TRUE(untangled.ok()) << untangled.status();
  EXPECT_NEAR(EnclosedVolume(untangled->surface), volume, 1e-4 * volume);
  EXPECT_THAT(untangled->warnings[0], HasSubstr("were replaced"));
  // Far from the fold nothing has changed.
  int moved = 0;
  for (const Point& p : ball.vertices) {
    if (Distance(p, fold) < 0.05) continue;
    moved += std::ranges::count(untangled->surface.vertices, p) == 0 ? 1 : 0;
  }
  EXPECT_EQ(moved, 0);
}

/// A box whose triangles do not share corners: each corner is moved by up to `apart_m`.
SurfaceMesh LooseBox(double apart_m) {
  const SurfaceMesh box = MakeBoxSurface({0.2, 0.03, 0.02});
  SurfaceMesh loose;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> part(-apart_m, apart_m);
  for (const auto& triangle : box.triangles) {
    auto& corners = loose.triangles.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      Point p = box.vertices[static_cast<size_t>(triangle[i])];
      for (double& x : p) x += part(random);
      corners[i] = static_cast<int32_t>(loose.vertices.size());
      loose.vertices.push_back(p);
    }
  }
  return loose;
}

TEST(PrepareSurface, CornersThatLieCloseTogetherAreJoinedBeforeAWrap) {
  for (const double apart_m : {2e-7, 3e-5}) {
    const auto joined = PrepareSurface(LooseBox(apart_m), {.repair = true});
    ASSERT_TRUE(joined.ok()) << joined.status();
    EXPECT_EQ(joined->surface.triangles.size(), 12U) << apart_m;
    EXPECT_NEAR(EnclosedVolume(joined->surface), 1.2e-4, 1e-2 * 1.2e-4);
  }
}

/// A cup of 0.1 m with a wall of 4 mm, an outer and an inner surface that meet at the rim, with a
/// hole and a slit from the rim through both.
SurfaceMesh CrackedCup() {
  constexpr int kAround = 48, kAlong = 12, kSlit = 20;
  const auto cup = [](double radius_m, double from_m, bool outward) {
    SurfaceMesh side;
    for (int k = 0; k <= kAlong; ++k) {
      for (int i = 0; i < kAround; ++i) {
        const double angle = 2 * kPi * i / kAround;
        side.vertices.push_back({radius_m * std::cos(angle), radius_m * std::sin(angle),
                                 from_m + (0.1 - from_m) * k / kAlong});
      }
    }
    for (int k = 0; k < kAlong; ++k) {
      for (int i = 0; i < kAround; ++i) {
        const int next = (i + 1) % kAround;
        const int32_t a = k * kAround + i, b = k * kAround + next;
        const int32_t c = a + kAround, d = b + kAround;
        if ((k >= 5 && k < 7 && i < 4) || (k >= 5 && i == kSlit)) continue;
        side.triangles.push_back({a, b, d});
        side.triangles.push_back({a, d, c});
      }
    }
    const auto middle = static_cast<int32_t>(side.vertices.size());
    side.vertices.push_back({0, 0, from_m});
    for (int32_t i = 0; i < kAround; ++i) side.triangles.push_back({middle, (i + 1) % kAround, i});
    for (auto& triangle : side.triangles) {
      if (!outward) std::swap(triangle[0], triangle[1]);
    }
    return side;
  };
  SurfaceMesh both = cup(0.05, 0, true);
  const auto inner = static_cast<int32_t>(both.vertices.size());
  AddShell(both, cup(0.046, 0.004, false), {0, 0, 0});
  for (int32_t i = 0; i < kAround; ++i) {
    if (i == kSlit) continue;
    const int32_t a = kAlong * kAround + i, b = kAlong * kAround + (i + 1) % kAround;
    both.triangles.push_back({a, b, b + inner});
    both.triangles.push_back({a, b + inner, a + inner});
  }
  return both;
}

TEST(PrepareSurface, AWallIsNotAdvisedAndRefusedWhereTheSurfaceHasTwoSides) {
  const SurfaceMesh cup = CrackedCup();
  const absl::Status open = PrepareSurface(cup, {}).status();
  EXPECT_THAT(open.ToString(), HasSubstr("MESH_NOT_CLOSED"));
  EXPECT_EQ(ToErrorInfo(open).metadata().at("wall_helps"), "0");
  const absl::Status repaired = PrepareSurface(cup, {.repair = true}).status();
  EXPECT_EQ(ToErrorInfo(repaired).metadata().at("wall_helps"), "0") << repaired;
  EXPECT_THAT(PrepareSurface(cup, {.wall_m = 0.0028}).status().ToString(),
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

TEST(PrepareSurface, BodiesApartAreNotJoined) {
  SurfaceMesh two = MakeBoxSurface({0.2, 0.05, 0.05});
  AddShell(two, MakeBoxSurface({0.2, 0.05, 0.05}), {0, 0.2, 0});
  EXPECT_THAT(PrepareSurface(two, {.repair = true}).status().ToString(),
              HasSubstr("MESH_SEVERAL_PIECES"));
}

TEST(RepairSoup, ATJunctionIsCutAndASeamClosed) {
  SurfaceMesh box = MakeBoxSurface({1, 1, 1});
  // The first triangle's first edge gets a vertex that its neighbour does not have.
  const auto [a, b, c] = box.triangles[0];
  const auto middle = static_cast<int32_t>(box.vertices.size());
  const auto [p, q, r] = CornersOf(box, 0);
  box.vertices.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
  box.triangles[0] = {a, middle, c};
  box.triangles.push_back({middle, b, c});
  EXPECT_THAT(CheckSurface(box).status().ToString(), HasSubstr("MESH_NOT_CLOSED"));
  const RepairedSurface repaired = RepairSoup(box);
  EXPECT_TRUE(CheckSurface(repaired.surface).ok());
  EXPECT_EQ(repaired.surface.triangles.size(), 14U);
}

}  // namespace
}  // namespace carillon::precompute
