// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/resolution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace carillon::precompute {
namespace {

/// A round with the given element size.
Round Solved(double element_size_mm, double worst_error) {
  return {.element_size_m = 1e-3 * element_size_mm,
          .node_count = 10'000,
          .thin = true,
          .worst_error = worst_error,
          .cpu_s = 1,
          .peak_bytes = 1e8};
}

TEST(Resolution, StopsWhereTheAccuracyIsReached) {
  EXPECT_FALSE(NextElementSize({.accuracy = 0.01}, {Solved(4, 0.009)}));
}

TEST(Resolution, GoesOnAsFarAsTheErrorNeeds) {
  const auto next = NextElementSize({.accuracy = 0.01}, {Solved(4, 0.02)});
  ASSERT_TRUE(next);
  EXPECT_GT(*next, 4e-3 / 2);
  EXPECT_LT(*next, 4e-3 / 1.2);
}

TEST(Resolution, LearnsFromTwoRoundsHowFastTheErrorFalls) {
  const ResolutionGoal goal{.accuracy = 0.01};
  const auto slow = NextElementSize(goal, {Solved(8, 0.06), Solved(4, 0.02)});
  const auto fast = NextElementSize(goal, {Solved(8, 0.2), Solved(4, 0.02)});
  ASSERT_TRUE(slow && fast);
  EXPECT_LT(*slow, *fast);
}

TEST(Resolution, RefinesWallsFurtherThanSolidsInAStep) {
  Round solid = Solved(4, 0.5);
  solid.thin = false;
  const auto wall = NextElementSize({.accuracy = 0.01}, {Solved(4, 0.5)});
  const auto inside = NextElementSize({.accuracy = 0.01}, {solid});
  ASSERT_TRUE(wall && inside);
  EXPECT_LT(*wall, *inside);
}

TEST(Resolution, GivesAGradedMeshTheSizeOfTheUniformOneAndTellsWhetherItIsFiner) {
  std::vector<Round> rounds{Solved(4, 0.02), Solved(1, 0.012)};
  EXPECT_TRUE(SetEquivalentSize(3e-3, rounds));
  EXPECT_EQ(rounds.back().element_size_m, 3e-3);
  EXPECT_TRUE(NextElementSize({.accuracy = 0.01}, rounds));
  rounds.back() = Solved(1, 0.02);
  EXPECT_FALSE(SetEquivalentSize(3e-3, rounds));
}

TEST(Resolution, ForeseesTheRoundsAfterTheNextOne) {
  EXPECT_LT(LaterRounds({.accuracy = 0.01}, {Solved(4, 0.02)}), 0.2) << "the next one is the last";
  // A thin wall needs (0.5/0.008)^(2/2.4) = 31 times the nodes, of which the next round has 6.
  EXPECT_NEAR(LaterRounds({.accuracy = 0.01}, {Solved(4, 0.5)}), 6.2, 0.5);
  EXPECT_LT(LaterRounds({.accuracy = 0.01, .budget_s = 5}, {Solved(4, 0.5)}), 0.2);
}

TEST(Resolution, KeepsToItsBudgets) {
  Round dear = Solved(4, 0.5);
  dear.cpu_s = 9;
  EXPECT_FALSE(NextElementSize({.accuracy = 0.01, .budget_s = 10}, {dear}));
  EXPECT_FALSE(NextElementSize({.budget_bytes = 1e8}, {Solved(4, 0.5)}));
  const auto next = NextElementSize({.budget_s = 60}, {Solved(4, 0.5)});
  ASSERT_TRUE(next);
  EXPECT_LT(*next, 4e-3 / 1.4);
}

}  // namespace
}  // namespace carillon::precompute
