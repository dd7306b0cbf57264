// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_events.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>

namespace carillon {
namespace {

constexpr size_t kCapacity = 1000, kBlock = 128;
constexpr uint64_t kLater = 1'000'000;

bool Never(const MixerEvent&, uint32_t) { return false; }

/// Number of events at a frame that the owner can push.
size_t Fill(PendingEvents& pending, uint32_t owner, uint64_t frame = kLater) {
  size_t count = 0;
  while (pending.TryPush({.frame = frame}, 0, owner)) ++count;
  return count;
}

TEST(PendingEvents, ASingleOwnerMayFillTheTable) {
  PendingEvents pending(kCapacity, kBlock);
  EXPECT_EQ(Fill(pending, 0), kCapacity);
}

TEST(PendingEvents, AnOwnerLeavesPlacesToTheNext) {
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

}  // namespace
}  // namespace carillon
