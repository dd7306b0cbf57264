// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/triangle_potential.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/mesh/point_math.h"
#include "precompute/radiation/triangle_rule.h"

namespace carillon::precompute {
namespace {

constexpr std::array<Point, 3> kCorners = {{{0, 0, 0}, {1, 0.1, 0.2}, {0.3, 0.9, -0.1}}};

/// Integrates by the fine rule on n^2 parts of the triangle.
TrianglePotentials Sampled(const Point& x, int n) {
  TrianglePotentials sum{};
  const Point area_normal = AreaNormal(kCorners);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < 2 * (n - i) - 1; ++j) {
      const bool turned = j % 2 == 1;
      const double u = i, v = std::floor(0.5 * j);
      for (const TrianglePoint& point : FineTriangleRule()) {
        double a = point.hat[1], b = point.hat[2];
        if (turned) a = 1 - a, b = 1 - b;
        const double h1 = (u + a) / n, h2 = (v + b) / n;
        const std::array<double, 3> hat = {1 - h1 - h2, h1, h2};
        const Point away = Difference(x, PlaceIn(kCorners, hat));
        const double weight = point.weight / (n * n) / 2, r = Norm(away);
        for (size_t c = 0; c < 3; ++c) {
          sum.single[c] += weight * Norm(area_normal) * hat[c] / r;
          sum.doubled[c] += weight * Dot(area_normal, away) * hat[c] / (r * r * r);
        }
      }
    }
  }
  return sum;
}

TEST(TrianglePotential, AgreesWithSamplingOffTheTriangle) {
  const TrianglePotential potential(kCorners);
  for (const Point& x : {Point{0.4, 0.3, 0.3}, Point{0.4, 0.3, -0.2}, Point{-0.3, 0.5, 0.1},
                         Point{2, 1, 0.5}, Point{0.5, 0.05, 0.15}}) {
    const TrianglePotentials exact = potential.At(x), sampled = Sampled(x, 40);
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(exact.single[c], sampled.single[c], 1e-6);
      EXPECT_NEAR(exact.doubled[c], sampled.doubled[c], 1e-5);
    }
  }
}

// The solid angle of a plane seen from close above its middle is half of the sphere.
TEST(TrianglePotential, JumpsByFourPiThroughTheTriangle) {
  const TrianglePotential potential(kCorners);
  const Point middle = MiddleOf(kCorners), normal = AreaNormal(kCorners);
  for (const double side : {1e-7, -1e-7}) {
    Point x = middle;
    for (size_t a = 0; a < 3; ++a) x[a] += side * normal[a];
    const auto at = potential.At(x).doubled;
    EXPECT_NEAR(at[0] + at[1] + at[2], std::copysign(2 * std::numbers::pi, side), 1e-5);
  }
}

TEST(TriangleRules, IntegratePolynomialsExactly) {
  // The integral of a^i b^j over the unit triangle, over its area: 2 i! j! / (i + j + 2)!.
  const auto check = [](std::span<const TrianglePoint> rule, int degree) {
    for (int i = 0; i <= degree; ++i) {
      const int j = degree - i;
      double sum = 0;
      for (const TrianglePoint& point : rule) {
        sum += point.weight * std::pow(point.hat[1], i) * std::pow(point.hat[2], j);
      }
      EXPECT_NEAR(sum, 2 * std::tgamma(i + 1) * std::tgamma(j + 1) / std::tgamma(i + j + 3), 1e-14);
    }
  };
  for (int degree = 0; degree <= 5; ++degree) {
    if (degree <= 2) check(CoarseTriangleRule(), degree);
    check(MediumTriangleRule(), degree);
    check(FineTriangleRule(), degree);
  }
}

}  // namespace
}  // namespace carillon::precompute
