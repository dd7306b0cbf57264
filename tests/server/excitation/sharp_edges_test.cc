// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/sharp_edges.h"

#include <gtest/gtest.h>

#include <optional>

#include "server/excitation/surface_curvature.h"
#include "tests/server/excitation/meshes.h"

namespace carillon {
namespace {

constexpr double kTiny = 1e-7;  // vertices are in single precision

/// A cube with sides of 10 cm about the origin.
class SharpEdgesTest : public testing::Test {
 protected:
  static Mesh Cube() {
    Mesh mesh;
    mesh.Add(MakeBox(0.1, 0.1, 0.1), 1, {-0.05F, -0.05F, -0.05F});
    return mesh;
  }

  const Mesh mesh_ = Cube();
  const SurfaceCurvature curvature_{mesh_.vertices, mesh_.triangles};
  const SharpEdges edges_{curvature_};
};

/// `found` at these coordinates.
void ExpectAt(const std::optional<Point>& found, const Point& right) {
  ASSERT_TRUE(found);
  for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR((*found)[axis], right[axis], kTiny);
}

TEST_F(SharpEdgesTest, ACubeHasTwelveAndNoDiagonals) {
  EXPECT_EQ(curvature_.sharp_edges().size(), 12U);
}

TEST_F(SharpEdgesTest, AContactBeneathACornerIsAtTheCornerAndOneBeneathAnEdgeOnTheEdge) {
  ExpectAt(edges_.Protruding({-0.045, -0.045, -0.045}, 0.005, {1, 1, 1}), {-0.05, -0.05, -0.05});
  ExpectAt(edges_.Protruding({0.01, -0.045, -0.045}, 0.005, {0, 1, 1}), {0.01, -0.05, -0.05});
}

TEST_F(SharpEdgesTest, AnEdgeElsewhereThanTheImpulseOrFartherThanThreeTimesTheDepthDoesNotCount) {
  EXPECT_FALSE(edges_.Protruding({-0.045, -0.045, -0.045}, 0.005, {-1, -1, -1}));
  EXPECT_FALSE(edges_.Protruding({0, 0, -0.045}, 0.005, {0, 0, 1}));
}

TEST_F(SharpEdgesTest, AContactBesideACornerIsAtTheCornerAndOneBesideAnEdgeOnTheEdge) {
  // As Havok rounds the corners of a face that lands flat.
  const Point beside{-0.04913, -0.04913, -0.05};
  ExpectAt(edges_.Beside(beside, 0.002, {0, 0, 1}), {-0.05, -0.05, -0.05});
  EXPECT_FALSE(edges_.Beside(beside, 0.0005, {0, 0, 1}));
  EXPECT_FALSE(edges_.Beside({-0.047, -0.047, -0.05}, 0.002, {0, 0, 1}));
  ExpectAt(edges_.Beside({-0.049, 0.01, -0.05}, 0.002, {0, 0, 1}), {-0.05, 0.01, -0.05});
}

TEST_F(SharpEdgesTest, AnEdgeBehindTheStruckSurfaceDoesNotCount) {
  // The top of a thin plate is no place of a contact from below.
  EXPECT_FALSE(edges_.Beside({-0.05, 0.01, 0.049}, 0.002, {0, 0, 1}));
  EXPECT_TRUE(edges_.Beside({-0.05, 0.01, 0.049}, 0.002, {0, 0, -1}));
}

TEST_F(SharpEdgesTest, ManyEdgesAreSearchedAsFew) {
  // A comb of 500 cubes along x; the edges of each are found among the others'.
  Mesh cubes;
  for (int cube = 0; cube < 500; ++cube) {
    cubes.Add(mesh_, 1, {0.2F * static_cast<float>(cube), 0, 0});
  }
  const SurfaceCurvature curvature(cubes.vertices, cubes.triangles);
  const SharpEdges comb(curvature);
  for (const double cube : {0.0, 211.0, 499.0}) {
    const auto found = comb.Beside({0.2 * cube - 0.049, -0.049, -0.05}, 0.002, {0, 0, 1});
    ASSERT_TRUE(found) << cube;
    EXPECT_NEAR((*found)[0], 0.2 * cube - 0.05, 1e-5);
  }
}

}  // namespace
}  // namespace carillon
