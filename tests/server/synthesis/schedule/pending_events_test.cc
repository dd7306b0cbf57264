// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_events.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

#include "server/synthesis/schedule/render_order.h"

namespace carillon {
namespace {

constexpr size_t kCapacity = 1000, kBlock = 128;
constexpr uint64_t kLater = 1'000'000;

bool Never(const MixerEvent&, uint32_t) { return false; }

/// Number of such events at a frame that the owner can push.
size_t Fill(PendingEvents& pending, uint32_t owner, uint64_t frame = kLater,
            const MixerEvent::Action& action = {}) {
  size_t count = 0;
  while (pending.TryPush({.frame = frame, .action = action}, 0, owner)) ++count;
  return count;
}

TEST(PendingEvents, AnOwnerLeavesPlacesToTheNextIfThereIsOne) {
  PendingEvents alone(kCapacity, kBlock);
  EXPECT_EQ(Fill(alone, 0), kCapacity);
  PendingEvents pending(kCapacity, kBlock, 3);
  EXPECT_EQ(Fill(pending, 0), 4 * kCapacity / 5);
  const size_t left = kCapacity - 4 * kCapacity / 5;
  EXPECT_EQ(Fill(pending, 1), 4 * left / 5);
  EXPECT_GT(Fill(pending, 2), 0U);
}

TEST(PendingEvents, CollectedEventsGiveTheirPlacesBackToTheirOwner) {
  PendingEvents pending(kCapacity, kBlock, 2);
  const size_t most = Fill(pending, 0, 0);
  FixedVector<uint32_t> due(kCapacity);
  pending.Collect(0, due, Never);
  EXPECT_EQ(due.size(), most);
  pending.Free(due);
  EXPECT_EQ(Fill(pending, 0, kBlock), most);
}

TEST(PendingEvents, StaleEventsAreCollectedBeforeTheyAreDue) {
  PendingEvents pending(kCapacity, kBlock);
  // Both lie in the list of block 0, the second one far in the future.
  const uint64_t far = uint64_t{4096} * kBlock;
  ASSERT_TRUE(pending.TryPush({.frame = far}, 1));
  ASSERT_TRUE(pending.TryPush({.frame = far}, 2));
  FixedVector<uint32_t> due(kCapacity);
  pending.Collect(0, due, [](const MixerEvent&, uint32_t tag) { return tag == 1; });
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(pending.tag(due[0]), 1U);
  due.clear();
  pending.Collect(far, due, Never);
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(pending.tag(due[0]), 2U);
}

TEST(PendingEvents, EachBlockHasPlacesForImpulsesAndForOtherEvents) {
  PendingEvents pending(kCapacity, kBlock, 1, {.impulses = 100, .others = 200});
  EXPECT_EQ(Fill(pending, 0, kBlock, SurfaceImpulse{}), 100U);
  EXPECT_FALSE(pending.TryPush({.frame = kBlock, .fraction = 0.5F, .action = ContactBegin{}}));
  // The first sample of an event between two samples is the later one, here of the next block.
  EXPECT_TRUE(
      pending.TryPush({.frame = 2 * kBlock - 1, .fraction = 0.5F, .action = ContactBegin{}}));
  EXPECT_EQ(Fill(pending, 0, 2 * kBlock - 1, ForceKnot{}), 200U);
  EXPECT_EQ(Fill(pending, 0, 2 * kBlock, SurfaceImpulse{}), 99U);
}

TEST(PendingEvents, OwnersShareThePlacesOfABlock) {
  PendingEvents pending(kCapacity, kBlock, 3, {.impulses = 100, .others = 200});
  EXPECT_EQ(Fill(pending, 0, kBlock, SurfaceImpulse{}), 80U);
  EXPECT_EQ(Fill(pending, 1, kBlock, SurfaceImpulse{}), 16U);
  EXPECT_GT(Fill(pending, 2, kBlock, SurfaceImpulse{}), 0U);
  EXPECT_EQ(Fill(pending, 1, 2 * kBlock, ForceKnot{}), 160U);
  EXPECT_EQ(Fill(pending, 1, 2 * kBlock, SurfaceImpulse{}), 48U);  // 208 are four times the free 52
}

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
