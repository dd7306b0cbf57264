// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_locator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "server/excitation/closest_point.h"

namespace carillon {
namespace {

using testing::HasSubstr;
using Vertex = std::array<float, 3>;
using Triangle = std::array<uint32_t, 3>;

/// A cylinder about z, as a fine mesh would have it, and the same side as two coarse given
/// triangles for each of `kSides` strips.
struct Tube {
  static constexpr uint32_t kSides = 24, kRings = 40;
  std::vector<Vertex> vertices, given_vertices;
  std::vector<Triangle> triangles, given_triangles;
  std::vector<uint32_t> given_triangle;

  Tube() {
    AddGrid(kRings, vertices, triangles);
    AddGrid(1, given_vertices, given_triangles);
    for (uint32_t t = 0; t < triangles.size(); ++t) given_triangle.push_back(GivenTriangleOf(t));
  }

  LocatorSurfaces surfaces() const {
    return {vertices, triangles, given_triangle, given_vertices, given_triangles};
  }

 private:
  static void AddGrid(uint32_t rings, std::vector<Vertex>& vertices,
                      std::vector<Triangle>& triangles) {
    for (uint32_t ring = 0; ring <= rings; ++ring) {
      for (uint32_t side = 0; side < kSides; ++side) {
        const double angle = 2 * M_PI * side / kSides;
        vertices.push_back({static_cast<float>(0.0125 * std::cos(angle)),
                            static_cast<float>(0.0125 * std::sin(angle)),
                            static_cast<float>(0.5 * ring / rings)});
      }
    }
    for (uint32_t ring = 0; ring < rings; ++ring) {
      for (uint32_t side = 0; side < kSides; ++side) {
        const uint32_t a = ring * kSides + side, b = ring * kSides + (side + 1) % kSides;
        triangles.push_back({a, b, b + kSides});
        triangles.push_back({a, b + kSides, a + kSides});
      }
    }
  }

  /// The half of the strip, below or above its diagonal, in which the triangle's middle lies.
  uint32_t GivenTriangleOf(uint32_t t) const {
    const uint32_t side = t / 2 % kSides;
    const uint32_t ring = t / 2 / kSides;
    const double z = (ring + (t % 2 == 0 ? 1.0 / 3 : 2.0 / 3)) / kRings;
    const double along = t % 2 == 0 ? 2.0 / 3 : 1.0 / 3;
    return 2 * side + (z > along ? 1 : 0);
  }
};

Point At(const std::vector<Vertex>& vertices, const Triangle& triangle,
         const std::array<double, 3>& weights) {
  Point point{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      point[axis] += weights[i] * double{vertices[triangle[i]][axis]};
    }
  }
  return point;
}

double Distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(SurfaceLocator, FindsTheNearestPointThatExhaustiveSearchFinds) {
  const Tube tube;
  const auto locator = SurfaceLocator::Make(tube.surfaces()).value();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> across(-0.03, 0.03), along(-0.1, 0.6);
  for (int i = 0; i < 300; ++i) {
    const Point point{across(random), across(random), along(random)};
    double nearest = INFINITY;
    for (const Triangle& triangle : tube.triangles) {
      const std::array<Point, 3> corners{At(tube.vertices, triangle, {1, 0, 0}),
                                         At(tube.vertices, triangle, {0, 1, 0}),
                                         At(tube.vertices, triangle, {0, 0, 1})};
      nearest = std::min(nearest, FindClosestPoint(corners, point).squared_distance_m2);
    }
    const LocatedPoint located = locator->Nearest(point).value();
    EXPECT_NEAR(located.distance_m, std::sqrt(nearest), 1e-9);
    EXPECT_EQ(located.vertices, tube.triangles[located.triangle]);
    EXPECT_NEAR(Distance(At(tube.vertices, located.vertices, located.weights), point),
                located.distance_m, 1e-9);
  }
}

TEST(SurfaceLocator, APointOfAGivenTriangleLiesOnATriangleOfIt) {
  const Tube tube;
  const auto locator = SurfaceLocator::Make(tube.surfaces()).value();
  for (uint32_t t = 0; t < tube.given_triangles.size(); ++t) {
    const std::array weights{0.2, 0.3, 0.5};
    const LocatedPoint located = locator->OnGivenTriangle({t, weights}).value();
    EXPECT_EQ(tube.given_triangle[located.triangle], t);
    // The fine triangles tile the flat side in steps: within one of them the point may be off by
    // its size, 3.3 mm by 12.5 mm.
    EXPECT_LT(located.distance_m, 0.0125);
    EXPECT_LT(Distance(At(tube.vertices, located.vertices, located.weights),
                       At(tube.given_vertices, tube.given_triangles[t], weights)),
              0.0125);
  }
}

TEST(SurfaceLocator, AGivenTriangleOfWhichNothingIsLeftIsStruckWhereItWas) {
  Tube tube;
  for (uint32_t& given : tube.given_triangle) given = given == 5 ? 4 : given;
  const auto locator = SurfaceLocator::Make(tube.surfaces()).value();
  const LocatedPoint located = locator->OnGivenTriangle({5, {0.2, 0.3, 0.5}}).value();
  EXPECT_LT(located.distance_m, 1e-7);
}

TEST(SurfaceLocator, AnswersSeveralThreadsAtOnce) {
  const Tube tube;
  const auto locator = SurfaceLocator::Make(tube.surfaces()).value();
  std::vector<double> distances(4);
  std::vector<std::thread> threads;
  threads.reserve(distances.size());
  for (double& distance : distances) {
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) distance += locator->Nearest({0, 0.02, 0.002 * i})->distance_m;
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const double distance : distances) EXPECT_EQ(distance, distances[0]);
}

TEST(SurfaceLocator, SaysWhyAContactCannotBeLocated) {
  const Tube tube;
  const auto locator = SurfaceLocator::Make(tube.surfaces()).value();
  EXPECT_THAT(locator->Nearest({NAN, 0, 0}).status().ToString(), HasSubstr("CONTACT_MALFORMED"));
  EXPECT_THAT(locator->Nearest({1e300, 0, 0}).status().ToString(), HasSubstr("CONTACT_MALFORMED"));
  EXPECT_THAT(locator->OnGivenTriangle({48, {1, 0, 0}}).status().ToString(),
              HasSubstr("CONTACT_MALFORMED"));
  EXPECT_THAT(locator->OnGivenTriangle({0, {1, 1, 0}}).status().ToString(),
              HasSubstr("CONTACT_MALFORMED"));
}

TEST(ClosestPoint, ATriangleWithoutAreaCountsAsItsEdges) {
  const std::array<Point, 3> line{Point{0, 0, 0}, Point{1, 0, 0}, Point{2, 0, 0}};
  EXPECT_NEAR(FindClosestPoint(line, {1.5, 1, 0}).squared_distance_m2, 1, 1e-12);
  const std::array<Point, 3> dot{Point{1, 1, 1}, Point{1, 1, 1}, Point{1, 1, 1}};
  EXPECT_NEAR(FindClosestPoint(dot, {1, 1, 3}).squared_distance_m2, 4, 1e-12);
}

}  // namespace
}  // namespace carillon
