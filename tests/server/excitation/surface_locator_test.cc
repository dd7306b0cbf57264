// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_locator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "server/excitation/closest_point.h"
#include "tests/server/excitation/meshes.h"

namespace carillon {
namespace {

using testing::HasSubstr;
/// A cylinder about z, as a fine mesh would have it, and the same side as two coarse given
/// triangles for each of `kSides` strips.
struct Tube {
  static constexpr uint32_t kSides = 24, kRings = 40;
  const Mesh fine = Make(kRings), given = Make(1);
  std::vector<uint32_t> given_triangle;

  Tube() {
    for (uint32_t t = 0; t < fine.triangles.size(); ++t) {
      given_triangle.push_back(GivenTriangleOf(t));
    }
  }

  std::unique_ptr<SurfaceLocator> MakeLocator() const {
    return SurfaceLocator::Make(
               {fine.vertices, fine.triangles, given_triangle, given.vertices, given.triangles})
        .value();
  }

 private:
  static Mesh Make(uint32_t rings) {
    return Lathe(rings, kSides,
                 [rings](uint32_t ring) { return std::pair(0.0125, 0.5 * ring / rings); });
  }

  /// The half of the strip, below or above its diagonal, in which the triangle's middle lies.
  static uint32_t GivenTriangleOf(uint32_t t) {
    const uint32_t side = t / 2 % kSides;
    const uint32_t ring = t / 2 / kSides;
    const double along = t % 2 == 0 ? 1.0 / 3 : 2.0 / 3;
    const double z = (ring + along) / kRings;
    return 2 * side + (z + along > 1 ? 1 : 0);
  }
};

double Distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(SurfaceLocator, TheNearestPointLiesAtItsWeightsAndDistance) {
  const Tube tube;
  const auto locator = tube.MakeLocator();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> across(-0.03, 0.03), along(-0.1, 0.6);
  for (int i = 0; i < 300; ++i) {
    const Point point{across(random), across(random), along(random)};
    const LocatedPoint located = locator->Nearest(point).value();
    EXPECT_EQ(located.vertices, tube.fine.triangles[located.triangle]);
    EXPECT_NEAR(Distance(tube.fine.At(located.vertices, located.weights), point),
                located.distance_m, 1e-9);
  }
}

TEST(SurfaceLocator, APointOfAGivenTriangleLiesOnATriangleOfIt) {
  const Tube tube;
  const auto locator = tube.MakeLocator();
  for (uint32_t t = 0; t < tube.given.triangles.size(); ++t) {
    const std::array weights{0.2, 0.3, 0.5};
    const LocatedPoint located = locator->OnGivenTriangle({t, weights}).value();
    EXPECT_EQ(tube.given_triangle[located.triangle], t);
    // The fine triangles tile the flat side in steps: within one of them the point may be off by
    // its size, 3.3 mm by 12.5 mm.
    EXPECT_LT(located.distance_m, 0.0125);
    EXPECT_LT(Distance(tube.fine.At(located.vertices, located.weights),
                       tube.given.At(tube.given.triangles[t], weights)),
              0.0125);
  }
}

TEST(SurfaceLocator, AGivenTriangleOfWhichNothingIsLeftIsStruckWhereItWas) {
  Tube tube;
  for (uint32_t& given : tube.given_triangle) given = given == 5 ? 4 : given;
  const auto locator = tube.MakeLocator();
  const LocatedPoint located = locator->OnGivenTriangle({5, {0.2, 0.3, 0.5}}).value();
  EXPECT_LT(located.distance_m, 1e-7);
}

TEST(SurfaceLocator, AnswersSeveralThreadsAtOnce) {
  const Tube tube;
  const auto locator = tube.MakeLocator();
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
  const auto locator = tube.MakeLocator();
  for (const absl::Status& status :
       {locator->Nearest({NAN, 0, 0}).status(), locator->Nearest({1e300, 0, 0}).status(),
        locator->OnGivenTriangle({48, {1, 0, 0}}).status(),
        locator->OnGivenTriangle({0, {1, 1, 0}}).status()}) {
    EXPECT_THAT(status.ToString(), HasSubstr("CONTACT_MALFORMED"));
  }
}

TEST(ClosestPoint, ATriangleWithoutAreaCountsAsItsEdges) {
  const std::array<Point, 3> line{Point{0, 0, 0}, Point{1, 0, 0}, Point{2, 0, 0}};
  EXPECT_NEAR(FindClosestPoint(line, {1.5, 1, 0}).squared_distance_m2, 1, 1e-12);
  const std::array<Point, 3> dot{Point{1, 1, 1}, Point{1, 1, 1}, Point{1, 1, 1}};
  EXPECT_NEAR(FindClosestPoint(dot, {1, 1, 3}).squared_distance_m2, 4, 1e-12);
}

}  // namespace
}  // namespace carillon
