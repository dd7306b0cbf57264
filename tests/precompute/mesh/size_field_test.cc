// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/size_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

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
