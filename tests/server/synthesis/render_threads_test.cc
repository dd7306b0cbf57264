// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace carillon {
namespace {

TEST(RenderThreads, RenderEachSectionOnceInEachRound) {
  for (const size_t thread_count : {1U, 2U, 5U}) {
    RenderThreads threads(thread_count);
    EXPECT_EQ(threads.size(), thread_count);
    std::vector<int> rendered(7), by_thread(thread_count);
    for (int round = 1; round <= 3000; ++round) {
      // Late threads of a round meet the next one, which may have fewer sections.
      const size_t count = static_cast<size_t>(round) % (rendered.size() + 1);
      std::ranges::fill(rendered, 0);
      const int before = by_thread[0];
      threads.Render(count, [&](size_t thread, size_t section) {
        ++rendered[section];
        ++by_thread[thread];
      });
      for (size_t section = 0; section < rendered.size(); ++section) {
        ASSERT_EQ(rendered[section], section < count ? 1 : 0) << round;
      }
      // A single section wakes no other thread.
      ASSERT_TRUE(count != 1 || by_thread[0] == before + 1);
    }
  }
}

}  // namespace
}  // namespace carillon
