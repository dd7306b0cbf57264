// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "server/excitation/sharp_edges.h"
#include "server/excitation/surface_measures.h"
#include "tests/server/excitation/meshes.h"

namespace carillon {
namespace {

/// A sphere of 2 cm as a lathe makes it: long triangles at the poles.
Mesh Sphere(uint32_t rings, uint32_t sides) { return MakeSphere(0.02, rings, sides, 0.02); }

Mesh Box() { return MakeBox(0.1, 0.06, 0.04); }

SurfaceCurvature CurvatureOf(const Mesh& mesh) {
  return SurfaceCurvature(mesh.vertices, mesh.triangles);
}

/// The curvature in the middle of a triangle.
double InMiddle(const Mesh& mesh, const SurfaceCurvature& curvature, uint32_t triangle,
                double size = 1) {
  return curvature.At(triangle, mesh.At(mesh.triangles[triangle], {1. / 3, 1. / 3, 1. / 3}), size);
}

TEST(SurfaceCurvature, ASphereHasThatOfItsRadiusHoweverItIsDivided) {
  for (const uint32_t rings : {12U, 40U}) {
    for (const uint32_t sides : {12U, 90U}) {
      Mesh mesh = Sphere(rings, sides);
      const SurfaceCurvature curvature = CurvatureOf(mesh);
      const uint32_t middle = rings / 2 * 2 * sides;
      EXPECT_NEAR(InMiddle(mesh, curvature, middle), 50, 5) << rings << ", " << sides;
      EXPECT_NEAR(InMiddle(mesh, curvature, middle, 10), 5, 0.5);
      mesh.TurnInsideOut();
      EXPECT_NEAR(InMiddle(mesh, CurvatureOf(mesh), middle), 50, 5);
    }
  }
}

TEST(SurfaceCurvature, NoiseOfAScannedSphereIsAveraged) {
  Mesh mesh = Sphere(40, 60);
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0, 2e-5F);  // 1 % of the edges
  for (auto& vertex : mesh.vertices) {
    for (float& x : vertex) x += noise(random);
  }
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  std::vector<double> found;
  for (uint32_t t = 20 * 120; t < 22 * 120; ++t) found.push_back(InMiddle(mesh, curvature, t));
  std::ranges::sort(found);
  EXPECT_NEAR(found[found.size() / 2], 50, 5);
  EXPECT_GT(found[found.size() / 10], 25);
  EXPECT_LT(found[found.size() * 9 / 10], 80);
}

TEST(SurfaceCurvature, ABoxIsFlatOnItsFacesAndSharpAtItsEdgesAndCorners) {
  const Mesh mesh = Box();
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  EXPECT_EQ(curvature.At(0, {0.03, 0.04, 0}, 1), 0);
  EXPECT_EQ(curvature.At(0, {0.05, 0.03, 0}, 1), 0);  // the diagonal of a face is no edge
  EXPECT_DOUBLE_EQ(curvature.At(0, {0, 0.03, 0}, 1), 0.5 / kEdgeRadiusM);
  EXPECT_DOUBLE_EQ(curvature.At(0, {0, 0.06, 0}, 1), 1 / kEdgeRadiusM);
  EXPECT_EQ(curvature.At(0, {0.001, 0.03, 0}, 1), 0);
  // The rounding of a real edge does not grow with the body.
  EXPECT_EQ(curvature.At(0, {0.0001, 0.03, 0}, 10), 0);
  // Up to rounding, any triangle of a corner is the nearest to a contact at the corner.
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t vertex : mesh.triangles[t]) {
      const auto& [x, y, z] = mesh.vertices[vertex];
      EXPECT_DOUBLE_EQ(curvature.At(t, {x, y, z}, 1), 1 / kEdgeRadiusM) << t << ", " << vertex;
    }
  }
}

TEST(SurfaceCurvature, ARimThatTurnsGraduallyHasNoCorners) {
  // A cylinder of 48 sides, closed by fans: the rims are edges everywhere.
  constexpr uint32_t kSides = 48;
  Mesh mesh = Lathe(1, kSides, [](uint32_t ring) { return std::pair(0.1, 0.1 * (1.0 - ring)); });
  mesh.vertices.push_back({0, 0, 0.1F});
  mesh.vertices.push_back({0, 0, 0});
  for (uint32_t a = 0; a < kSides; ++a) {
    const uint32_t b = (a + 1) % kSides;
    mesh.triangles.push_back({a, b, 2 * kSides});
    mesh.triangles.push_back({b + kSides, a + kSides, 2 * kSides + 1});
  }
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [x, y, z] = mesh.vertices[mesh.triangles[t][0]];
    EXPECT_DOUBLE_EQ(curvature.At(t, {x, y, z}, 1), 0.5 / kEdgeRadiusM) << t;
  }
}

TEST(SurfaceCurvature, AnInnerEdgeIsNotSharp) {
  Mesh mesh = Box();
  mesh.TurnInsideOut();
  // Beside it, a large box of the right side, so that the surface as a whole is not inside out: a
  // body with a hollow in the shape of a box.
  mesh.Add(Box(), 3, {-0.1F, -0.06F, -0.04F});
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  EXPECT_EQ(curvature.At(0, {0, 0.03, 0}, 1), 0);
  EXPECT_NEAR(VolumeM3(mesh.vertices, mesh.triangles), 26 * 0.1 * 0.06 * 0.04, 1e-9);
}

TEST(SurfaceMeasures, ABoxHasItsVolumeAndDiagonal) {
  const Mesh mesh = Box();
  EXPECT_NEAR(VolumeM3(mesh.vertices, mesh.triangles), 0.1 * 0.06 * 0.04, 1e-10);
  EXPECT_NEAR(ExtentM(mesh.vertices), std::hypot(0.1, 0.06, 0.04), 1e-8);
  EXPECT_EQ(VolumeM3(mesh.vertices, {}), 0);
}

TEST(SurfaceMeasures, ABoxHasItsInertiaWhicheverWayItsTrianglesTurn) {
  Mesh mesh = Box();
  const double volume = 0.1 * 0.06 * 0.04;
  for (int turned = 0; turned < 2; ++turned, mesh.TurnInsideOut()) {
    const auto inertia = InertiaM5(mesh.vertices, mesh.triangles);
    const std::array<double, 3> squares{0.1 * 0.1, 0.06 * 0.06, 0.04 * 0.04};
    for (size_t i = 0; i < 3; ++i) {
      const double across = squares[(i + 1) % 3] + squares[(i + 2) % 3];
      EXPECT_NEAR(inertia[i][i], volume * across / 12, 1e-12);
      EXPECT_NEAR(inertia[i][(i + 1) % 3], 0, 1e-12);
    }
  }
  EXPECT_EQ(InertiaM5(mesh.vertices, {})[0][0], 0);
}

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
