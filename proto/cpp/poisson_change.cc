// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/poisson_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace carillon {
namespace {

constexpr size_t kKinds = 4;
/// Near nu = 0 the kinds have equal slopes, and cannot be told apart.
constexpr double kLeastSlope = 0.05;
/// Models round the ratio to 1e-4. The remainder allows for the rounding of the difference.
constexpr double kSame = 1.0001e-4, kFarthest = 0.07 + 1e-9;

std::array<double, kKinds> Stiffnesses(double nu) {
  return {1 / (1 + nu), 1, 1 / (1 - nu * nu), (1 - nu) / ((1 + nu) * (1 - 2 * nu))};
}

std::array<double, kKinds> Slopes(double nu) {
  return {-1 / (1 + nu), 0, 2 * nu / (1 - nu * nu), 2 / (1 - 2 * nu) - 1 / (1 - nu) - 1 / (1 + nu)};
}

}  // namespace

double EigenvalueChange(double slope, double from, double to) {
  const std::array<double, kKinds> slopes = Slopes(from);
  if (slopes[2] < kLeastSlope) return std::max(0.05, 1 + slope * (to - from));
  const std::array<double, kKinds> before = Stiffnesses(from), after = Stiffnesses(to);
  const size_t kind = slope < slopes[1] ? 0 : slope < slopes[2] ? 1 : 2;
  const double part = (slope - slopes[kind]) / (slopes[kind + 1] - slopes[kind]);
  const double change =
      (1 - part) * after[kind] / before[kind] + part * after[kind + 1] / before[kind + 1];
  return std::max(0.05, change);
}

bool ServesPoissonRatio(double from, double to, bool has_slopes) {
  return std::abs(to - from) <= (has_slopes ? kFarthest : kSame);
}

}  // namespace carillon
