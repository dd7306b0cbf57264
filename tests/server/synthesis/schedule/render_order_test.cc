// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/render_order.h"

#include <gtest/gtest.h>

#include <array>

namespace carillon {
namespace {

using Fields = RenderOrder::Fields;

TEST(RenderOrder, GivesBackTheLargestValueOfEachField) {
  const Fields most{.section = RenderOrder::kMostSections - 1,
                    .block = RenderOrder::kMostBlocks - 1,
                    .slot = RenderOrder::kMostSlots - 1,
                    .offset = RenderOrder::kMostGroups * kMergedFrames - 1,
                    .merged = true,
                    .arrival = RenderOrder::kMostArrivals - 1};
  const Fields back = RenderOrder(most).fields();
  EXPECT_EQ(back.section, most.section);
  EXPECT_EQ(back.block, most.block);
  EXPECT_EQ(back.slot, most.slot);
  EXPECT_EQ(back.offset, most.offset);
  EXPECT_TRUE(back.merged);
  EXPECT_EQ(back.arrival, most.arrival);
}

TEST(RenderOrder, AFieldOutweighsAllThatFollowIt) {
  // Each comes after the one before by one field, and before it by all later fields.
  const std::array<Fields, 7> ascending = {{
      {.section = 0, .block = 9, .slot = 9, .offset = 99, .merged = true, .arrival = 9},
      {.section = 1, .block = 0, .slot = 9, .offset = 99, .merged = true, .arrival = 9},
      {.section = 1, .block = 1, .slot = 0, .offset = 99, .merged = true, .arrival = 9},
      {.section = 1, .block = 1, .slot = 1, .offset = 3, .merged = true, .arrival = 9},
      {.section = 1, .block = 1, .slot = 1, .offset = 7, .merged = false, .arrival = 9},
      {.section = 1, .block = 1, .slot = 1, .offset = 4, .merged = true, .arrival = 0},
      {.section = 1, .block = 1, .slot = 1, .offset = 4, .merged = true, .arrival = 1},
  }};
  for (size_t i = 1; i < ascending.size(); ++i) {
    EXPECT_LT(RenderOrder(ascending[i - 1]), RenderOrder(ascending[i])) << i;
  }
}

}  // namespace
}  // namespace carillon
