// SPDX-License-Identifier: Apache-2.0
#include "server/api/fair_pool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <latch>
#include <vector>

namespace carillon {
namespace {

TEST(FairPool, AClientWithMuchWorkLeavesHalfOfTheThreadsToOthers) {
  std::latch go(1);
  std::latch other_ran(3);
  std::atomic<int> running{0};
  {
    FairPool pool(2);
    for (int i = 0; i < 20; ++i) {
      pool.Run("busy", [&] {
        EXPECT_EQ(++running, 1);
        go.wait();
        --running;
      });
    }
    for (int i = 0; i < 3; ++i) pool.Run("other", [&] { other_ran.count_down(); });
    other_ran.wait();  // would not return if the busy client had both threads
    go.count_down();
  }
  EXPECT_EQ(running, 0);
}

TEST(FairPool, ClientsTakeTurnsOnOneThread) {
  std::latch go(1);
  std::vector<int> order;
  {
    FairPool pool(1);
    pool.Run("first", [&] { go.wait(); });
    for (int i = 0; i < 3; ++i) pool.Run("first", [&order] { order.push_back(1); });
    for (int i = 0; i < 2; ++i) pool.Run("second", [&order] { order.push_back(2); });
    go.count_down();
  }
  EXPECT_THAT(order, testing::ElementsAre(2, 1, 2, 1, 1));
}

TEST(FairPool, TheTasksOfAClientStartInOrderAndAllRun) {
  std::vector<int> order;
  {
    FairPool pool(2);
    for (int i = 0; i < 100; ++i) pool.Run("a", [&order, i] { order.push_back(i); });
  }
  EXPECT_EQ(order.size(), 100U);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

}  // namespace
}  // namespace carillon
