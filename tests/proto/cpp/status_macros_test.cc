// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/status_macros.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

absl::Status Refused() { return absl::InvalidArgumentError("refused"); }

template <typename Value>
absl::StatusOr<Value> RefusedValue() {
  return Refused();
}

/// Counts how often an expression is evaluated.
struct Evaluated {
  absl::Status Return(absl::Status status) {
    ++count;
    return status;
  }
  absl::StatusOr<int> ReturnNumber(int number) {
    ++count;
    return number;
  }
  int count = 0;
};

absl::Status ReturnIfError(Evaluated& evaluated, const absl::Status& status, bool& went_on) {
  RETURN_IF_ERROR(evaluated.Return(status));
  went_on = true;
  return absl::OkStatus();
}

TEST(ReturnIfError, ReturnsAnErrorAndEvaluatesOnce) {
  Evaluated evaluated;
  bool went_on = false;
  EXPECT_EQ(ReturnIfError(evaluated, Refused(), went_on), Refused());
  EXPECT_FALSE(went_on);
  EXPECT_EQ(evaluated.count, 1);
}

TEST(ReturnIfError, GoesOnWithoutAnError) {
  Evaluated evaluated;
  bool went_on = false;
  EXPECT_EQ(ReturnIfError(evaluated, absl::OkStatus(), went_on), absl::OkStatus());
  EXPECT_TRUE(went_on);
  EXPECT_EQ(evaluated.count, 1);
}

absl::Status ReturnInABranch(bool check, bool& took_else) {
  if (check)
    RETURN_IF_ERROR(Refused());
  else
    took_else = true;
  return absl::OkStatus();
}

TEST(ReturnIfError, IsOneStatementBelowAnIf) {
  bool took_else = false;
  EXPECT_EQ(ReturnInABranch(true, took_else), Refused());
  EXPECT_FALSE(took_else);
  EXPECT_EQ(ReturnInABranch(false, took_else), absl::OkStatus());
  EXPECT_TRUE(took_else);
}

template <typename First, typename Second>
absl::Status RefuseBoth(std::pair<First, Second>) {
  return Refused();
}

absl::StatusOr<int> ReturnWithCommas() {
  RETURN_IF_ERROR(RefuseBoth<int, float>(std::pair<int, float>{1, 2.0F}));
  return 1;
}

TEST(ReturnIfError, TakesCommasAndReturnsAStatusOr) {
  EXPECT_EQ(ReturnWithCommas().status(), Refused());
}

absl::StatusOr<int> Sum(Evaluated& evaluated) {
  ASSIGN_OR_RETURN(const int first, evaluated.ReturnNumber(1));
  ASSIGN_OR_RETURN(int second, evaluated.ReturnNumber(2));
  ASSIGN_OR_RETURN(second, evaluated.ReturnNumber(second + 20));
  return first + second;
}

TEST(AssignOrReturn, DeclaresAndAssignsAndEvaluatesOnce) {
  Evaluated evaluated;
  EXPECT_EQ(*Sum(evaluated), 23);
  EXPECT_EQ(evaluated.count, 3);
}

absl::Status AssignError(int& kept, bool& went_on) {
  ASSIGN_OR_RETURN(kept, RefusedValue<int>());
  went_on = true;
  return absl::OkStatus();
}

TEST(AssignOrReturn, ReturnsAnErrorAndLeavesTheTarget) {
  int kept = 7;
  bool went_on = false;
  EXPECT_EQ(AssignError(kept, went_on), Refused());
  EXPECT_EQ(kept, 7);
  EXPECT_FALSE(went_on);
}

template <typename Key, typename Value>
absl::StatusOr<std::map<Key, Value>> MakeMap(Key key, Value value) {
  return std::map<Key, Value>{{key, value}};
}

absl::StatusOr<std::map<int, char>> AssignMap() {
  ASSIGN_OR_RETURN((std::map<int, char> map), MakeMap<int, char>(1, 'a'));
  return map;
}

TEST(AssignOrReturn, TakesCommasInTheTypeAndInTheExpression) {
  EXPECT_THAT(*AssignMap(), ElementsAre(Pair(1, 'a')));
}

}  // namespace
}  // namespace carillon
