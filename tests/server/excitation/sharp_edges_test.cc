// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/sharp_edges.h"

#include <gtest/gtest.h>

#include <vector>

#include "server/excitation/surface_curvature.h"

namespace carillon {
namespace {

constexpr double kTiny = 1e-7;  // vertices are in single precision

/// A cube with sides of 10 cm about the origin.
class SharpEdgesTest : public testing::Test {
 protected:
  static std::vector<std::array<float, 3>> Vertices() {
    std::vector<std::array<float, 3>> vertices;
    for (const float z : {-0.05F, 0.05F}) {
      vertices.insert(
          vertices.end(),
          {{-0.05F, -0.05F, z}, {0.05F, -0.05F, z}, {0.05F, 0.05F, z}, {-0.05F, 0.05F, z}});
    }
    return vertices;
  }

  const std::vector<std::array<float, 3>> vertices_ = Vertices();
  const std::vector<std::array<uint32_t, 3>> triangles_{{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7},
                                                        {0, 1, 5}, {0, 5, 4}, {1, 2, 6}, {1, 6, 5},
                                                        {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  const SurfaceCurvature curvature_{vertices_, triangles_};
  const SharpEdges edges_{curvature_};
};

TEST_F(SharpEdgesTest, ACubeHasTwelveAndNoDiagonals) {
  EXPECT_EQ(curvature_.sharp_edges().size(), 12U);
}

TEST_F(SharpEdgesTest, AContactBeneathACornerIsAtTheCorner) {
  const auto found = edges_.Protruding({-0.045, -0.045, -0.045}, 0.005, {1, 1, 1});
  ASSERT_TRUE(found);
  for (const double coordinate : *found) EXPECT_NEAR(coordinate, -0.05, kTiny);
}

TEST_F(SharpEdgesTest, AContactBeneathAnEdgeIsOnTheEdgeBesideIt) {
  const auto found = edges_.Protruding({0.01, -0.045, -0.045}, 0.005, {0, 1, 1});
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found)[0], 0.01, kTiny);
  EXPECT_NEAR((*found)[1], -0.05, kTiny);
  EXPECT_NEAR((*found)[2], -0.05, kTiny);
}

TEST_F(SharpEdgesTest, AnEdgeThatIsNotWhereTheImpulseComesFromDoesNotCount) {
  EXPECT_FALSE(edges_.Protruding({-0.045, -0.045, -0.045}, 0.005, {-1, -1, -1}));
}

TEST_F(SharpEdgesTest, AnEdgeFartherThanThreeTimesTheDepthDoesNotCount) {
  EXPECT_FALSE(edges_.Protruding({0, 0, -0.045}, 0.005, {0, 0, 1}));
}

TEST_F(SharpEdgesTest, AContactBesideACornerIsAtTheCorner) {
  // As Havok rounds the corners of a face that lands flat.
  const Point beside{-0.04913, -0.04913, -0.05};
  const auto found = edges_.Beside(beside, 0.002, {0, 0, 1});
  ASSERT_TRUE(found);
  for (const double coordinate : *found) EXPECT_NEAR(coordinate, -0.05, kTiny);
  EXPECT_FALSE(edges_.Beside(beside, 0.0005, {0, 0, 1}));
  EXPECT_FALSE(edges_.Beside({-0.047, -0.047, -0.05}, 0.002, {0, 0, 1}));
}

TEST_F(SharpEdgesTest, AContactBesideAnEdgeIsOnTheEdge) {
  const auto found = edges_.Beside({-0.049, 0.01, -0.05}, 0.002, {0, 0, 1});
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found)[0], -0.05, kTiny);
  EXPECT_NEAR((*found)[1], 0.01, kTiny);
}

TEST_F(SharpEdgesTest, AnEdgeBehindTheStruckSurfaceDoesNotCount) {
  // The top of a thin plate is no place of a contact from below.
  EXPECT_FALSE(edges_.Beside({-0.05, 0.01, 0.049}, 0.002, {0, 0, 1}));
  EXPECT_TRUE(edges_.Beside({-0.05, 0.01, 0.049}, 0.002, {0, 0, -1}));
}

TEST_F(SharpEdgesTest, ManyEdgesAreSearchedAsFew) {
  // A comb of 500 cubes along x; the edges of each are found among the others'.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  for (uint32_t cube = 0; cube < 500; ++cube) {
    for (const auto& [a, b, c] : triangles_) {
      triangles.push_back({a + 8 * cube, b + 8 * cube, c + 8 * cube});
    }
    for (const auto& [x, y, z] : vertices_) {
      vertices.push_back({x + 0.2F * static_cast<float>(cube), y, z});
    }
  }
  const SurfaceCurvature curvature(vertices, triangles);
  const SharpEdges comb(curvature);
  for (const double cube : {0.0, 211.0, 499.0}) {
    const auto found = comb.Beside({0.2 * cube - 0.049, -0.049, -0.05}, 0.002, {0, 0, 1});
    ASSERT_TRUE(found) << cube;
    EXPECT_NEAR((*found)[0], 0.2 * cube - 0.05, 1e-5);
  }
}

}  // namespace
}  // namespace carillon
