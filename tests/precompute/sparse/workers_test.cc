// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/workers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <vector>

namespace carillon::precompute {
namespace {

struct WorkersTest : ::testing::TestWithParam<int> {
  Workers workers{GetParam()};
};

TEST_P(WorkersTest, EachItemIsVisitedOnce) {
  std::vector<std::atomic<int>> visits(500);
  workers.ForEach(500, [&](int64_t i) { ++visits[static_cast<size_t>(i)]; });
  for (const std::atomic<int>& count : visits) EXPECT_EQ(count, 1);
}

INSTANTIATE_TEST_SUITE_P(Counts, WorkersTest, ::testing::Values(1, 2, 5));

}  // namespace
}  // namespace carillon::precompute
