// SPDX-License-Identifier: Apache-2.0
//
// What runs on the threads of a pool: chores, and the tasks of clients that take turns.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <latch>
#include <utility>
#include <vector>

#include "server/api/call/chore.h"
#include "server/api/call/fair_turns.h"

namespace carillon {
namespace {

/// A chore on one thread. The pool ends before the chore.
struct OwnChore {
  explicit OwnChore(std::function<void()> work) : chore(pool, std::move(work)), pool(1) {}

  Chore chore;
  ThreadPool pool;
};

TEST(Chore, DoesNotWaitForItselfInThePool) {
  std::atomic<int> count{0};
  std::latch begun(1);
  std::latch go(1);
  OwnChore own([&] {
    if (++count == 1) begun.count_down();
    go.wait();
  });
  own.chore.Start();
  begun.wait();
  own.chore.Start();  // does nothing, because the work of the first call goes on
  go.count_down();
  own.chore.Stop();
  EXPECT_EQ(count, 1);
}

TEST(Chore, DoesNothingAfterItsEnd) {
  std::atomic<int> count{0};
  {
    OwnChore own([&] { ++count; });
    own.chore.Start();
    own.chore.Stop();
    own.chore.Start();
  }
  EXPECT_EQ(count, 1);
}

/// Turns on some threads of a pool. The pool ends before the turns.
struct SharedThreads {
  SharedThreads(int thread_count, int most_running)
      : turns(pool, most_running), pool(thread_count) {}

  FairTurns turns;
  ThreadPool pool;
};

TEST(FairTurns, AClientWithMuchWorkLeavesHalfOfTheThreadsToOthers) {
  std::latch go(1);
  std::latch other_ran(3);
  std::atomic<int> running{0};
  {
    SharedThreads threads(2, 2);
    for (int i = 0; i < 20; ++i) {
      threads.turns.Run("busy", [&] {
        EXPECT_EQ(++running, 1);
        go.wait();
        --running;
      });
    }
    for (int i = 0; i < 3; ++i) threads.turns.Run("other", [&] { other_ran.count_down(); });
    other_ran.wait();  // would not return if the busy client had both threads
    go.count_down();
  }
  EXPECT_EQ(running, 0);
}

TEST(FairTurns, ClientsTakeTurnsOnOneThread) {
  std::latch go(1);
  std::vector<int> order;
  {
    SharedThreads threads(1, 1);
    threads.turns.Run("first", [&] { go.wait(); });
    for (int i = 0; i < 3; ++i) threads.turns.Run("first", [&order] { order.push_back(1); });
    for (int i = 0; i < 2; ++i) threads.turns.Run("second", [&order] { order.push_back(2); });
    go.count_down();
  }
  EXPECT_THAT(order, testing::ElementsAre(2, 1, 2, 1, 1));
}

TEST(FairTurns, LeaveTheOtherThreadsToThePool) {
  std::latch both_run(2);
  std::latch go(1);
  std::latch other_ran(1);
  {
    SharedThreads threads(3, 2);
    for (const char* client : {"a", "a", "b", "b", "c", "c"}) {
      threads.turns.Run(client, [&] {
        if (!both_run.try_wait()) both_run.count_down();
        go.wait();
      });
    }
    both_run.wait();
    threads.pool.Run([&] { other_ran.count_down(); });
    other_ran.wait();  // would not return if the turns had all threads
    go.count_down();
  }
}

TEST(FairTurns, TheTasksOfAClientStartInOrderAndAllRun) {
  std::vector<int> order;
  {
    SharedThreads threads(2, 2);
    for (int i = 0; i < 100; ++i) threads.turns.Run("a", [&order, i] { order.push_back(i); });
  }
  EXPECT_EQ(order.size(), 100U);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

}  // namespace
}  // namespace carillon
