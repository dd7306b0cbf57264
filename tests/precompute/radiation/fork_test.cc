// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/radiation/fork.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace carillon::precompute {
namespace {

// Near by, a tuning fork has four lobes: a linear quadrupole's (3 cos^2 - 1)/r^3 is zero at 54.7
// degrees (Russell, Am. J. Phys. 68, 2000).
TEST(Fork, HasFourLobesNearBy) {
  const std::vector<double> levels = LevelsRoundFork(0.05);
  const auto least = std::ranges::min_element(levels) - levels.begin();
  EXPECT_GE(least, 50);
  EXPECT_LE(least, 56);
  EXPECT_LT(levels[static_cast<size_t>(least)], -20);
  EXPECT_NEAR(levels[90], -6, 2);
}

// Far away it has two: cos^2.
TEST(Fork, HasTwoLobesFarAway) {
  const std::vector<double> levels = LevelsRoundFork(100);
  for (const size_t degree : {15U, 30U, 45U, 60U}) {
    const double cosine = std::cos(static_cast<double>(degree) * std::numbers::pi / 180);
    EXPECT_NEAR(levels[degree], 40 * std::log10(cosine), 1) << degree;
  }
  EXPECT_LT(levels[90], -20);
}

}  // namespace
}  // namespace carillon::precompute
