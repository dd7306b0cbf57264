// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/size_field.h"
#include "precompute/mesh/sounding_surface.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

const Point& At(const TetMesh& mesh, int32_t node) { return mesh.nodes[static_cast<size_t>(node)]; }

double VolumeIn(const TetMesh& mesh, const SoundingSurface& sounding) {
  SurfaceMesh surface{.vertices = {}, .triangles = sounding.triangles};
  for (const int32_t node : sounding.nodes) surface.vertices.push_back(At(mesh, node));
  return EnclosedVolume(surface);
}

TEST(Boundary, IsOrientedOutward) {
  const TetMesh mesh = MakeTetBox({1, 2, 3}, {2, 3, 4}, 4);
  EXPECT_NEAR(EnclosedVolume(BoundarySurface(mesh)), 6, 1e-12);  // rounding
}

TEST(Boundary, FoundAgainOnAQuadraticMeshNamesTheSameMidsideNodes) {
  const TetMesh made = MakeTetBox({1, 1, 1}, {2, 2, 2}, 10);
  TetMesh found = made;
  ASSERT_TRUE(FindBoundary(found).ok());
  ASSERT_EQ(found.boundary.size(), made.boundary.size());
  for (size_t i = 0; i < made.boundary.size(); ++i) {
    EXPECT_EQ(found.boundary[i].nodes, made.boundary[i].nodes);
  }
}

TEST(Boundary, OfATetrahedronGivenThreeTimesIsRefused) {
  TetMesh mesh = MakeTetBox({1, 1, 1}, {1, 1, 1}, 4);
  const std::vector<int32_t> first(mesh.elements.begin(), mesh.elements.begin() + 4);
  for (int copy = 0; copy < 2; ++copy) {
    mesh.elements.insert(mesh.elements.end(), first.begin(), first.end());
  }
  EXPECT_THAT(FindBoundary(mesh).ToString(), HasSubstr("MESH_NOT_MANIFOLD"));
}

TEST(MidsideNodes, LieInTheMiddleOfTheirEdgesAndAreShared) {
  const TetMesh mesh = MakeTetBox({1, 1, 1}, {2, 2, 2}, 10);
  // Euler: a box of 2 x 2 x 2 cells of six tetrahedra has 27 nodes, 48 tetrahedra and 48 faces
  // on its boundary, so 98 edges.
  EXPECT_EQ(mesh.nodes.size(), 27U + 98U);
  for (size_t e = 0; e < mesh.elements.size(); e += 10) {
    for (size_t edge = 0; edge < 6; ++edge) {
      const Point& p = At(mesh, mesh.elements[e + static_cast<size_t>(kTetEdges[edge][0])]);
      const Point& q = At(mesh, mesh.elements[e + static_cast<size_t>(kTetEdges[edge][1])]);
      const Point& m = At(mesh, mesh.elements[e + 4 + edge]);
      for (size_t x = 0; x < 3; ++x) EXPECT_DOUBLE_EQ(m[x], (p[x] + q[x]) / 2);
    }
  }
}

TEST(SoundingSurface, EnclosesTheVolumeOfTheTube) {
  const Tube tube{.around = 16, .along = 20};
  const double inner = tube.outer_radius_m - tube.wall_m;
  const double volume = std::numbers::pi * tube.length_m *
                        (tube.outer_radius_m * tube.outer_radius_m - inner * inner);
  for (const int nodes_per_element : {4, 10}) {
    const TetMesh mesh = MakeTetTube(tube, nodes_per_element);
    EXPECT_NEAR(VolumeIn(mesh, MakeSoundingSurface(mesh)), volume, 1e-12 * volume);
  }
}

TEST(SoundingSurface, SplitsSixNodeFacesInFourOnTheSameGivenTriangle) {
  const TetMesh linear = MakeTetBox({1, 1, 1}, {2, 2, 2}, 4);
  const TetMesh quadratic = MakeTetBox({1, 1, 1}, {2, 2, 2}, 10);
  const SoundingSurface coarse = MakeSoundingSurface(linear);
  const SoundingSurface fine = MakeSoundingSurface(quadratic);
  ASSERT_EQ(coarse.triangles.size(), 48U);
  ASSERT_EQ(fine.triangles.size(), 4 * 48U);
  for (size_t t = 0; t < fine.triangles.size(); ++t) {
    EXPECT_EQ(fine.given_triangle[t], coarse.given_triangle[t / 4]);
  }
}

TEST(SoundingSurface, HasTheBoundaryNodesOnceAndNoNodeInside) {
  const TetMesh mesh = MakeTetBox({1, 1, 1}, {3, 3, 3}, 10);
  const SoundingSurface surface = MakeSoundingSurface(mesh);
  const std::set<int32_t> nodes(surface.nodes.begin(), surface.nodes.end());
  EXPECT_EQ(nodes.size(), surface.nodes.size());
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const bool outside =
        std::ranges::any_of(mesh.nodes[n], [](double x) { return x == 0 || x == 1; });
    EXPECT_EQ(nodes.contains(static_cast<int32_t>(n)), outside) << "node " << n;
  }
}

std::vector<Point> RandomPoints(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Point> points(count);
  for (Point& p : points) {
    for (double& x : p) x = static_cast<double>(random()) / 4294967296.0;
  }
  return points;
}

TEST(SizeField, IsOneEverywhereWithoutPoints) {
  EXPECT_TRUE(SizeField().is_uniform());
  EXPECT_EQ(SizeField().At({1, 2, 3}), 1);
}

TEST(SizeField, IsTheSmallestSizeThatAnyPointAllows) {
  const std::vector<Point> points = RandomPoints(500, 1);
  std::vector<double> sizes;
  for (const Point& p : RandomPoints(500, 2)) sizes.push_back(0.1 + p[0]);
  const SizeField field(points, sizes, 0.5);
  EXPECT_FALSE(field.is_uniform());
  for (const Point& place : RandomPoints(200, 3)) {
    double smallest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < points.size(); ++i) {
      smallest = std::min(smallest, sizes[i] + 0.5 * Distance(place, points[i]));
    }
    EXPECT_EQ(field.At(place), smallest);
  }
}

TEST(SizeField, MovesWithItsBody) {
  const SizeField field({{1, 1, 1}, {2, 1, 1}}, {0.5, 2}, 0.25);
  const SizeField moved = field.Moved({1, 1, 1}, 10);
  EXPECT_NEAR(moved.At({4, 0, 0}), field.At({1.4, 1, 1}), 1e-12);  // rounding
  EXPECT_NEAR(moved.At({4, 0, 0}), 0.6, 1e-12);
}

}  // namespace
}  // namespace carillon::precompute
