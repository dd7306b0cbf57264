// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/chore.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <latch>
#include <utility>

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

}  // namespace
}  // namespace carillon
