// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/step_budget.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(StepBudget, GrowsByAFifthOfTheTimeThatPasses) {
  StepBudget budget;
  EXPECT_TRUE(budget.Allows(seconds(100)));
  budget.Spend(milliseconds(30));  // 10 ms more than there were
  EXPECT_FALSE(budget.Allows(seconds(100)));
  EXPECT_FALSE(budget.Allows(seconds(100) + milliseconds(50)));
  EXPECT_TRUE(budget.Allows(seconds(100) + milliseconds(60)));
}

TEST(StepBudget, DoesNotGrowBeyondItsMost) {
  StepBudget budget;
  EXPECT_TRUE(budget.Allows(seconds(1)));
  EXPECT_TRUE(budget.Allows(seconds(1000)));
  budget.Spend(milliseconds(20));
  EXPECT_FALSE(budget.Allows(seconds(1000)));
}

TEST(StepBudget, HoldsNoMoreThanItsMostBytes) {
  StepBudget budget;
  EXPECT_TRUE(budget.Hold(StepBudget::kMostWaitingBytes - 1));
  EXPECT_FALSE(budget.Hold(2));
  EXPECT_TRUE(budget.Hold(1));
  budget.Release(2);
  EXPECT_TRUE(budget.Hold(2));
}

TEST(StepBudgets, AllStreamsOfAClientShareOne) {
  StepBudgets budgets;
  const auto first = budgets.Of("a");
  EXPECT_EQ(budgets.Of("a"), first);
  EXPECT_NE(budgets.Of("b"), first);
}

}  // namespace
}  // namespace carillon
