// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/resolution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace carillon::precompute {
namespace {

using ::testing::StartsWith;

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

TEST(Resolution, EndsWhereTheMeshCannotBeRefined) {
  EXPECT_FALSE(NextElementSize({.accuracy = 0.01}, {Solved(4, 0.02), Solved(4, 0.02)}));
}

TEST(Resolution, GivesAGradedMeshTheSizeOfTheUniformOneAndTellsWhetherItIsFiner) {
  std::vector<Round> rounds{Solved(4, 0.02), Solved(1, 0.012)};
  EXPECT_TRUE(SetEquivalentSize(3e-3, rounds));
  EXPECT_EQ(rounds.back().element_size_m, 3e-3);
  EXPECT_TRUE(NextElementSize({.accuracy = 0.01}, rounds));
  rounds.back() = Solved(1, 0.02);
  EXPECT_FALSE(SetEquivalentSize(3e-3, rounds));
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

TEST(Resolution, ABudgetThatWasOverrunIsSaidWithWhatWasUsed) {
  const double gib = 1024.0 * 1024 * 1024;
  const ResolutionGoal goal{.budget_s = 10, .budget_bytes = 2 * gib};
  EXPECT_TRUE(OverrunWarnings(goal, 9.9, 1.9 * gib).empty());
  const auto slow = OverrunWarnings(goal, 12.5, 1.9 * gib);
  ASSERT_EQ(slow.size(), 1U);
  EXPECT_THAT(slow[0], StartsWith("the budget of 10 s of processor time was overrun: 12.5 were"));
  const auto large = OverrunWarnings(goal, 9.9, 2.25 * gib);
  ASSERT_EQ(large.size(), 1U);
  EXPECT_THAT(large[0], StartsWith("the budget of 2 GiB of memory was overrun: 2.25 were used"));
  EXPECT_EQ(OverrunWarnings(goal, 12.5, 2.25 * gib).size(), 2U);
  EXPECT_TRUE(OverrunWarnings({.accuracy = 0.01}, 1e9, 1e15).empty());
}

TEST(Resolution, EndsAfterSomeRounds) {
  std::vector<Round> rounds;
  for (const double element_size_mm : {32, 16, 8, 4, 2})
    rounds.push_back(Solved(element_size_mm, 0.5));
  EXPECT_TRUE(NextElementSize({.accuracy = 1e-9}, rounds));
  rounds.push_back(Solved(1, 0.5));
  EXPECT_FALSE(NextElementSize({.accuracy = 1e-9}, rounds));
}

TEST(TimeGrowth, IsThatOfTheNodesAndMore) {
  const Round wall{.element_size_m = 0.002, .thin = true};
  EXPECT_DOUBLE_EQ(TimeGrowth(wall, 0.002), 1);
  // Half the element size: four times the nodes of a wall, eight times those of a solid.
  EXPECT_GT(TimeGrowth(wall, 0.001), 4);
  EXPECT_GT(TimeGrowth({.element_size_m = 0.002, .thin = false}, 0.001), 8);
}

}  // namespace
}  // namespace carillon::precompute
