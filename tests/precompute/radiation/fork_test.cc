// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/radiation/fork.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/mode_solver.h"

namespace carillon::precompute {
namespace {

/// Levels in dB against the direction in which the tines move, each degree from 0 to 90, round the
/// tines at four fifths of their length.
std::vector<double> LevelsRound(double distance_m) {
  const Fork fork = MakeFork();
  Workers workers(2);
  SurfaceLevel level;
  level.surface = MakeAcousticSurface(fork.mesh);
  level.near = MakeNearCorrection(level.surface, workers);
  RadiatingSurface body;
  body.center = {0, 0, Fork::kLengthM / 2};
  body.radius_m = 0.05;
  const SphereGrid grid(PatternOrder(Fork::kWavenumber, body.radius_m));
  const ModeField field = SolveModes({.wavenumber = Fork::kWavenumber,
                                      .displacements = {fork.motion},
                                      .starts = {},
                                      .tolerance = 1e-4},
                                     level, body, grid, workers)
                              .front();
  std::vector<double> levels;
  for (int degree = 0; degree <= 90; ++degree) {
    const double angle = degree * std::numbers::pi / 180;
    const Point place = {distance_m * std::cos(angle), distance_m * std::sin(angle),
                         0.8 * Fork::kLengthM};
    levels.push_back(20 * std::log10(std::abs(PressureAt(place, level.surface, Fork::kWavenumber,
                                                         field.pressure, fork.motion))));
  }
  for (size_t i = levels.size(); i-- > 0;) levels[i] -= levels[0];
  return levels;
}

// Near by, a tuning fork has four lobes: a linear quadrupole's (3 cos^2 - 1)/r^3 is zero at 54.7
// degrees (Russell, Am. J. Phys. 68, 2000).
TEST(Fork, HasFourLobesNearBy) {
  const std::vector<double> levels = LevelsRound(0.05);
  const auto least = std::ranges::min_element(levels) - levels.begin();
  EXPECT_GE(least, 50);
  EXPECT_LE(least, 56);
  EXPECT_LT(levels[static_cast<size_t>(least)], -20);
  EXPECT_NEAR(levels[90], -6, 2);
}

// Far away it has two: cos^2.
TEST(Fork, HasTwoLobesFarAway) {
  const std::vector<double> levels = LevelsRound(100);
  for (const size_t degree : {15U, 30U, 45U, 60U}) {
    const double cosine = std::cos(static_cast<double>(degree) * std::numbers::pi / 180);
    EXPECT_NEAR(levels[degree], 40 * std::log10(cosine), 1) << degree;
  }
  EXPECT_LT(levels[90], -20);
}

}  // namespace
}  // namespace carillon::precompute
