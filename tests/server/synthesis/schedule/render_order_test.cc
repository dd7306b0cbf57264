// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/render_order.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace carillon
