// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <vector>

namespace carillon::precompute {
namespace {

using ::testing::Each;

struct WorkersTest : ::testing::TestWithParam<int> {
  Workers workers{GetParam()};
};

TEST_P(WorkersTest, EachRunsTheWorkOnceInAThreadOfItsOwn) {
  std::vector<std::thread::id> threads(static_cast<size_t>(GetParam()));
  for (int round = 0; round < 100; ++round) {
    workers.Run([&](int t) { threads[static_cast<size_t>(t)] = std::this_thread::get_id(); });
  }
  EXPECT_EQ(std::set(threads.begin(), threads.end()).size(), threads.size());
  EXPECT_EQ(threads[0], std::this_thread::get_id());
}

TEST_P(WorkersTest, PartsCoverEverythingOnce) {
  for (const int64_t n : {0, 1, 7, 64, 1000}) {
    std::vector<int> visits(static_cast<size_t>(n), 0);
    workers.ForParts(n, 8, [&](int64_t begin, int64_t end, int) {
      EXPECT_EQ(begin % 8, 0);
      for (int64_t i = begin; i < end; ++i) ++visits[static_cast<size_t>(i)];
    });
    EXPECT_THAT(visits, Each(1));
  }
}

TEST_P(WorkersTest, EachItemIsVisitedOnce) {
  std::vector<std::atomic<int>> visits(500);
  workers.ForEach(500, [&](int64_t i) { ++visits[static_cast<size_t>(i)]; });
  for (const std::atomic<int>& count : visits) EXPECT_EQ(count, 1);
}

INSTANTIATE_TEST_SUITE_P(Counts, WorkersTest, ::testing::Values(1, 2, 5));

}  // namespace
}  // namespace carillon::precompute
