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
  const SharpEdges edges_{vertices_, curvature_.sharp_edges()};
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

}  // namespace
}  // namespace carillon
