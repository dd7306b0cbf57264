// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/poisson_change.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace carillon::fit {
namespace {

constexpr size_t kKinds = 4;
/// Near nu = 0 the kinds have equal slopes, and cannot be told apart.
constexpr double kLeastSlope = 0.05;

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

}  // namespace carillon::fit
