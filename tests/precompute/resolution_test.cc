// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/resolution.h"

#include <gtest/gtest.h>

#include <vector>

namespace carillon::precompute {
namespace {

TEST(Resolution, StopsWhereTheAccuracyIsReached) {
  EXPECT_FALSE(NextCornerNodeCount({.accuracy = 0.01}, {{2000, 0.009, 1, 1e8}}));
}

TEST(Resolution, GoesOnAsFarAsTheErrorNeeds) {
  const auto next = NextCornerNodeCount({.accuracy = 0.01}, {{2000, 0.02, 1, 1e8}});
  ASSERT_TRUE(next);
  EXPECT_GT(*next, 2000 * 1.4);
  EXPECT_LT(*next, 2000 * 2);
}

TEST(Resolution, LearnsFromTwoRoundsHowFastTheErrorFalls) {
  const ResolutionGoal goal{.accuracy = 0.01};
  const auto slow = NextCornerNodeCount(goal, {{1000, 0.04, 1, 1e8}, {2000, 0.02, 2, 2e8}});
  const auto fast = NextCornerNodeCount(goal, {{1000, 0.08, 1, 1e8}, {2000, 0.02, 2, 2e8}});
  ASSERT_TRUE(slow && fast);
  EXPECT_GT(*slow, *fast);
}

TEST(Resolution, GoesFurtherWhereTheMeshDidNotGrow) {
  const auto next =
      NextCornerNodeCount({.accuracy = 0.01}, {{2000, 0.015, 1, 1e8}, {2000, 0.015, 1, 1e8}});
  ASSERT_TRUE(next);
  EXPECT_GE(*next, 3 * 2000);
}

TEST(Resolution, KeepsToItsBudgets) {
  EXPECT_FALSE(NextCornerNodeCount({.accuracy = 0.01, .budget_s = 10}, {{2000, 0.5, 9, 1e8}}));
  EXPECT_FALSE(NextCornerNodeCount({.budget_bytes = 1e9}, {{2000, 0.5, 9, 1e9}}));
  const auto next = NextCornerNodeCount({.budget_s = 60}, {{2000, 0.5, 1, 1e8}});
  ASSERT_TRUE(next);
  EXPECT_GT(*next, 2 * 2000);
}

TEST(Resolution, EndsAfterSomeRounds) {
  EXPECT_FALSE(NextCornerNodeCount({.accuracy = 1e-9}, std::vector<Round>(6, {2000, 0.5, 1, 1e8})));
}

}  // namespace
}  // namespace carillon::precompute
