// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/find_overlaps.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

constexpr int kRotationCount = 10;
constexpr Point kSize = {0.2, 0.03, 0.01};
constexpr std::array<int, 3> kCells = {20, 4, 2};
constexpr double kVolume = 0.2 * 0.03 * 0.01;
/// The sides of a cell.
constexpr double kAlong = 0.2 / 20, kAcross = 0.03 / 4;

/// A bar whose sides are grids of triangles.
SurfaceMesh MakeBar() { return BoundarySurface(MakeTetBox(kSize, kCells, 4)); }

/// The vertex of the bar at a place in its grid.
int32_t VertexAt(const SurfaceMesh& bar, const std::array<int, 3>& place) {
  const Point sought = {place[0] * kAlong, place[1] * kAcross, kSize[2] * place[2] / kCells[2]};
  const auto away = [&](const Point& p) { return Distance(p, sought); };
  return static_cast<int32_t>(std::ranges::min_element(bar.vertices, {}, away) -
                              bar.vertices.begin());
}

/// The bar with one vertex in the middle of its upper face moved within the face.
SurfaceMesh WithVertexMoved(double along_m, double across_m) {
  SurfaceMesh bar = MakeBar();
  Point& p = bar.vertices[static_cast<size_t>(VertexAt(bar, {10, 2, 2}))];
  p[0] += along_m;
  p[1] += across_m;
  return bar;
}

/// Cuts each triangle at the edge from `a` to `b` in two, at the vertex `at` of its middle.
template <typename VertexOf>
void CutAt(SurfaceMesh& surface, int32_t a, int32_t b, VertexOf at) {
  const size_t count = surface.triangles.size();
  for (size_t t = 0; t < count; ++t) {
    auto near_half = surface.triangles[t], far_half = near_half;
    if (std::ranges::count(near_half, a) + std::ranges::count(near_half, b) < 2) continue;
    const int32_t vertex = at(MiddleOf(CornersOf(surface, t)));
    std::ranges::replace(near_half, b, vertex);
    std::ranges::replace(far_half, a, vertex);
    surface.triangles[t] = near_half;
    surface.triangles.push_back(far_half);
  }
}

/// Cuts them at a new vertex.
void Cut(SurfaceMesh& surface, int32_t a, int32_t b, const Point& at) {
  const auto middle = static_cast<int32_t>(surface.vertices.size());
  surface.vertices.push_back(at);
  CutAt(surface, a, b, [&](const Point&) { return middle; });
}

/// The bar with an edge cut at two places in the wrong order: slivers of width 10 um that are
/// folded back.
SurfaceMesh WithSliversFoldedBack() {
  SurfaceMesh bar = MakeBar();
  const int32_t a = VertexAt(bar, {10, 2, 2}), b = VertexAt(bar, {11, 2, 2});
  const Point middle = {10.5 * kAlong, 2 * kAcross, kSize[2]};
  const auto first = static_cast<int32_t>(bar.vertices.size());
  Cut(bar, a, b, middle);
  Cut(bar, first, b, {middle[0] - 1e-5, middle[1], middle[2]});
  return bar;
}

/// The bar with two triangles of opposite orientation, with vertices of their own, on its upper
/// face: an edge is opened, and its sides are drawn past each other.
SurfaceMesh WithCoincidentFaces() {
  SurfaceMesh surface = MakeBar();
  const int32_t a = VertexAt(surface, {10, 2, 2}), b = VertexAt(surface, {11, 2, 2});
  const auto back = static_cast<int32_t>(surface.vertices.size()), forth = back + 1;
  for (const double across : {-0.3, 0.6}) {
    surface.vertices.push_back({10.5 * kAlong, (2 + across) * kAcross, kSize[2]});
  }
  CutAt(surface, a, b, [&](const Point& middle) { return middle[1] > 2 * kAcross ? back : forth; });
  surface.triangles.push_back({a, forth, back});
  surface.triangles.push_back({forth, b, back});
  return surface;
}

std::map<std::string, SurfaceMesh> Folded() {
  return {{"a vertex past its neighbour along", WithVertexMoved(1.6 * kAlong, 0.3 * kAcross)},
          {"a vertex past its neighbour across", WithVertexMoved(0.2 * kAlong, 1.4 * kAcross)},
          {"a vertex past two neighbours", WithVertexMoved(2.6 * kAlong, 0.3 * kAcross)},
          {"slivers folded back", WithSliversFoldedBack()},
          {"coincident faces", WithCoincidentFaces()}};
}

/// The rotation of a random quaternion.
SurfaceMesh Rotated(SurfaceMesh surface, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  double w = normal(random);
  Point u = {normal(random), normal(random), normal(random)};
  const double length = std::hypot(w, Norm(u));
  w /= length;
  for (double& x : u) x /= length;
  for (Point& p : surface.vertices) {
    const Point once = Cross(u, p), twice = Cross(u, once);
    for (size_t i = 0; i < 3; ++i) p[i] += 2 * (w * once[i] + twice[i]);
  }
  return surface;
}

/// The surface as a file in single precision has it.
SurfaceMesh InSinglePrecision(SurfaceMesh surface) {
  for (Point& p : surface.vertices) {
    for (double& x : p) x = static_cast<double>(static_cast<float>(x));
  }
  return surface;
}

/// The least volume of a tetrahedron, in cubes of its longest edge.
double LeastQuality(const TetMesh& mesh) {
  double least = 1;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* n = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const auto at = [&](int i) { return mesh.nodes[static_cast<size_t>(n[i])]; };
    double longest = 0;
    for (const auto& [i, j] : kTetEdges) longest = std::max(longest, Distance(at(i), at(j)));
    least = std::min(least, TetVolume(at(0), at(1), at(2), at(3)) / std::pow(longest, 3));
  }
  return least;
}

void ExpectRefusedAndRepaired(const SurfaceMesh& folded) {
  EXPECT_THAT(PrepareSurface(folded, {}).status().ToString(), HasSubstr("MESH_SELF_INTERSECTING"));
  const auto repaired = PrepareSurface(folded, {.repair = true}).value();
  // The repaired triangles lie in one plane, so that the volume changes by rounding alone.
  EXPECT_NEAR(EnclosedVolume(repaired.surface), kVolume, 1e-6 * kVolume);
  EXPECT_THAT(repaired.warnings, ::testing::Contains(HasSubstr("were replaced")));
}

TEST(ObliqueFold, IsRefusedAndRepairedWhereItIsInAnyRotation) {
  for (const auto& [name, folded] : Folded()) {
    for (unsigned seed = 0; seed < kRotationCount; ++seed) {
      SCOPED_TRACE(name + ", rotation " + std::to_string(seed));
      const SurfaceMesh rotated = Rotated(folded, seed);
      ExpectRefusedAndRepaired(rotated);
      if (seed < 3) ExpectRefusedAndRepaired(InSinglePrecision(rotated));
    }
  }
}

TEST(ObliqueFold, LeavesNoFlatTetrahedraOnceRepaired) {
  for (const auto& [name, folded] : Folded()) {
    SCOPED_TRACE(name);
    const auto repaired = PrepareSurface(Rotated(folded, 1), {.repair = true}).value();
    const auto mesh = Tetrahedralize(repaired.surface, {.nodes_per_element = 4}).value();
    // Stiffness and mass of flatter elements are lost to rounding in the factorization.
    EXPECT_GT(LeastQuality(mesh), 1e-6);
  }
}

TEST(ObliqueFold, OfAnEdgeOfTheBodyIsRepaired) {
  SurfaceMesh bar = MakeBar();
  bar.vertices[static_cast<size_t>(VertexAt(bar, {10, 0, 2}))][0] += 1.5 * kAlong;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const SurfaceMesh folded = Rotated(bar, seed);
    EXPECT_THAT(PrepareSurface(folded, {}).status().ToString(),
                HasSubstr("MESH_SELF_INTERSECTING"));
    const auto repaired = PrepareSurface(folded, {.repair = true}).value();
    EXPECT_NEAR(EnclosedVolume(repaired.surface), kVolume, 1e-2 * kVolume);
  }
}

TEST(FindOverlaps, FindsNoneOnSoundBodies) {
  SurfaceMesh hollow = MakeSphereSurface(0.1, 3);
  AddShell(hollow, InsideOut(MakeSphereSurface(0.08, 3)));
  const std::vector<SurfaceMesh> sound = {MakeBar(),
                                          MakeSphereSurface(0.1, 4),
                                          MakeTubeSurface({}),
                                          MakeBoxSurface({1, 1, 1}),
                                          hollow,
                                          MakeTubeSurface({.around = 64, .along = 1})};
  for (size_t s = 0; s < sound.size(); ++s) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      EXPECT_TRUE(FindOverlaps(Rotated(sound[s], seed), 1).empty()) << s;
      EXPECT_TRUE(FindOverlaps(InSinglePrecision(Rotated(sound[s], seed)), 1).empty()) << s;
    }
  }
}

TEST(FindOverlaps, FindsNoneOnAFoilOrAKnife) {
  // A square metre, a fifth of a micrometre thick.
  EXPECT_TRUE(FindOverlaps(Rotated(MakeBoxSurface({1, 1, 2e-7}), 1), 1).empty());
  SurfaceMesh knife;  // its edge has an angle of 0.001
  knife.vertices = {{0, 0, 0},        {0.2, 0, 0},       {0.2, 0.05, 25e-6},
                    {0, 0.05, 25e-6}, {0, 0.05, -25e-6}, {0.2, 0.05, -25e-6}};
  knife.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 4, 5}, {0, 5, 1},
                     {3, 2, 5}, {3, 5, 4}, {0, 3, 4}, {1, 5, 2}};
  EXPECT_TRUE(FindOverlaps(Rotated(knife, 1), 1).empty());
}

TEST(FindOverlaps, NamesBothTrianglesAndStopsAtTheNumberAskedFor) {
  const SurfaceMesh folded = Rotated(WithVertexMoved(1.6 * kAlong, 0.3 * kAcross), 1);
  const auto all = FindOverlaps(folded, folded.triangles.size());
  ASSERT_GT(all.size(), 2U);
  EXPECT_EQ(FindOverlaps(folded, 2).size(), 2U);
  for (const auto& [first, second] : all) {
    EXPECT_LT(first, second);
    const Point a = AreaNormal(CornersOf(folded, static_cast<size_t>(first)));
    const Point b = AreaNormal(CornersOf(folded, static_cast<size_t>(second)));
    EXPECT_NEAR(std::abs(Dot(a, b)) / (Norm(a) * Norm(b)), 1, 1e-9);
  }
}

}  // namespace
}  // namespace carillon::precompute
