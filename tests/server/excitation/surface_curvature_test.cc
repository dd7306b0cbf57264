// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "server/excitation/surface_measures.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;

struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;

  Point Middle(uint32_t triangle) const {
    Point middle{};
    for (const uint32_t vertex : triangles[triangle]) {
      for (size_t axis = 0; axis < 3; ++axis) middle[axis] += vertices[vertex][axis] / 3.0;
    }
    return middle;
  }
  void TurnInsideOut() {
    for (auto& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }
};

/// A sphere of `rings` rings of `sides` facets, as a lathe makes it: long triangles at the poles.
Mesh Sphere(double radius_m, uint32_t rings, uint32_t sides) {
  Mesh mesh;
  for (uint32_t ring = 0; ring <= rings; ++ring) {
    const double polar = kPi * (0.02 + 0.96 * ring / rings);
    for (uint32_t side = 0; side < sides; ++side) {
      const double angle = 2 * kPi * side / sides;
      mesh.vertices.push_back({static_cast<float>(radius_m * std::sin(polar) * std::cos(angle)),
                               static_cast<float>(radius_m * std::sin(polar) * std::sin(angle)),
                               static_cast<float>(radius_m * std::cos(polar))});
    }
  }
  for (uint32_t ring = 0; ring < rings; ++ring) {
    for (uint32_t side = 0; side < sides; ++side) {
      const uint32_t next = (side + 1) % sides, a = ring * sides + side, b = ring * sides + next;
      mesh.triangles.push_back({a, a + sides, b});
      mesh.triangles.push_back({b, a + sides, b + sides});
    }
  }
  return mesh;
}

/// A box of 100 by 60 by 40 mm, each face two triangles.
Mesh Box() {
  Mesh mesh;
  for (uint32_t corner = 0; corner < 8; ++corner) {
    mesh.vertices.push_back({(corner & 1) != 0 ? 0.1F : 0, (corner & 2) != 0 ? 0.06F : 0,
                             (corner & 4) != 0 ? 0.04F : 0});
  }
  for (const std::array<uint32_t, 4>& face : std::vector<std::array<uint32_t, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.triangles.push_back({face[0], face[1], face[2]});
    mesh.triangles.push_back({face[0], face[2], face[3]});
  }
  return mesh;
}

SurfaceCurvature CurvatureOf(const Mesh& mesh) {
  return SurfaceCurvature(mesh.vertices, mesh.triangles);
}

TEST(SurfaceCurvature, ASphereHasThatOfItsRadiusHoweverItIsDivided) {
  for (const uint32_t rings : {12U, 40U}) {
    for (const uint32_t sides : {12U, 90U}) {
      Mesh mesh = Sphere(0.02, rings, sides);
      const SurfaceCurvature curvature = CurvatureOf(mesh);
      const uint32_t middle = rings / 2 * 2 * sides;
      EXPECT_NEAR(curvature.At(middle, mesh.Middle(middle), 1), 50, 5) << rings << ", " << sides;
      EXPECT_NEAR(curvature.At(middle, mesh.Middle(middle), 10), 5, 0.5);
      mesh.TurnInsideOut();
      const SurfaceCurvature other = CurvatureOf(mesh);
      EXPECT_NEAR(other.At(middle, mesh.Middle(middle), 1), 50, 5);
    }
  }
}

TEST(SurfaceCurvature, NoiseOfAScannedSphereIsAveraged) {
  Mesh mesh = Sphere(0.02, 40, 60);
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0, 2e-5F);  // 1 % of the edges
  for (auto& vertex : mesh.vertices) {
    for (float& x : vertex) x += noise(random);
  }
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  std::vector<double> found;
  for (uint32_t t = 20 * 120; t < 22 * 120; ++t)
    found.push_back(curvature.At(t, mesh.Middle(t), 1));
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
}

TEST(SurfaceCurvature, ACornerIsSharpOnEachOfItsTriangles) {
  // Up to rounding, any of them is the nearest to a contact at the corner.
  const Mesh mesh = Box();
  const SurfaceCurvature curvature = CurvatureOf(mesh);
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t vertex : mesh.triangles[t]) {
      const auto& [x, y, z] = mesh.vertices[vertex];
      EXPECT_DOUBLE_EQ(curvature.At(t, {x, y, z}, 1), 1 / kEdgeRadiusM) << t << ", " << vertex;
    }
  }
}

TEST(SurfaceCurvature, ARimThatTurnsGraduallyHasNoCorners) {
  // A cylinder of 48 sides, closed by fans: the rims are edges everywhere.
  Mesh mesh;
  constexpr uint32_t kSides = 48;
  for (uint32_t side = 0; side < kSides; ++side) {
    const double angle = 2 * kPi * side / kSides;
    for (const float z : {0.0F, 0.1F}) {
      mesh.vertices.push_back({static_cast<float>(0.1 * std::cos(angle)),
                               static_cast<float>(0.1 * std::sin(angle)), z});
    }
  }
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({0, 0, 0.1F});
  for (uint32_t side = 0; side < kSides; ++side) {
    const uint32_t a = 2 * side, b = 2 * ((side + 1) % kSides);
    mesh.triangles.insert(
        mesh.triangles.end(),
        {{a, b, a + 1}, {b, b + 1, a + 1}, {b, a, 2 * kSides}, {a + 1, b + 1, 2 * kSides + 1}});
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
  const Mesh outer = Box();
  const auto count = static_cast<uint32_t>(mesh.vertices.size());
  for (const auto& vertex : outer.vertices) {
    mesh.vertices.push_back({3 * vertex[0] - 0.1F, 3 * vertex[1] - 0.06F, 3 * vertex[2] - 0.04F});
  }
  for (const auto& [a, b, c] : outer.triangles) {
    mesh.triangles.push_back({a + count, b + count, c + count});
  }
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

}  // namespace
}  // namespace carillon
