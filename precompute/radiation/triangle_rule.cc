// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/triangle_rule.h"

#include <cmath>
#include <cstddef>

namespace carillon::precompute {
namespace {

constexpr size_t kMediumCount = 7;

std::array<TrianglePoint, 3> MakeCoarse() {
  constexpr double kFar = 2.0 / 3, kNear = 1.0 / 6, kWeight = 1.0 / 3;
  return {{{{kFar, kNear, kNear}, kWeight},
           {{kNear, kFar, kNear}, kWeight},
           {{kNear, kNear, kFar}, kWeight}}};
}

/// Radon's rule (1948), which consists of the middle and two orbits of three points.
std::array<TrianglePoint, kMediumCount> MakeMedium() {
  std::array<TrianglePoint, kMediumCount> rule{};
  rule[0] = {{1.0 / 3, 1.0 / 3, 1.0 / 3}, 9.0 / 40};
  const double root = std::sqrt(15.0);
  for (size_t orbit = 0; orbit < 2; ++orbit) {
    const double sign = orbit == 0 ? 1 : -1;
    const double pair = (6 + sign * root) / 21, single = 1 - 2 * pair;
    for (size_t c = 0; c < 3; ++c) {
      TrianglePoint& point = rule[1 + 3 * orbit + c];
      point = {{pair, pair, pair}, (155 + sign * root) / 1200};
      point.hat[c] = single;
    }
  }
  return rule;
}

std::array<TrianglePoint, 4 * kMediumCount> MakeFine() {
  std::array<TrianglePoint, 4 * kMediumCount> rule{};
  const auto medium = MakeMedium();
  for (size_t i = 0; i < kMediumCount; ++i) {
    const auto& hat = medium[i].hat;
    for (size_t quarter = 0; quarter < 4; ++quarter) {
      TrianglePoint& point = rule[4 * i + quarter];
      point.weight = medium[i].weight / 4;
      for (size_t c = 0; c < 3; ++c) {
        // Three of the quarters share one corner each with the whole triangle. The last quarter
        // lies between them, rotated by half a turn.
        point.hat[c] = quarter < 3 ? hat[c] / 2 + (c == quarter ? 0.5 : 0) : (1 - hat[c]) / 2;
      }
    }
  }
  return rule;
}

}  // namespace

std::span<const TrianglePoint> CoarseTriangleRule() {
  static const auto rule = MakeCoarse();
  return rule;
}

std::span<const TrianglePoint> MediumTriangleRule() {
  static const auto rule = MakeMedium();
  return rule;
}

std::span<const TrianglePoint> FineTriangleRule() {
  static const auto rule = MakeFine();
  return rule;
}

Point PlaceIn(const std::array<Point, 3>& corner, const std::array<double, 3>& hat) {
  Point place{};
  for (size_t c = 0; c < 3; ++c) {
    for (size_t a = 0; a < 3; ++a) place[a] += hat[c] * corner[c][a];
  }
  return place;
}

}  // namespace carillon::precompute
