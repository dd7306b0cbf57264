// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/block_broadcast.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace carillon {
namespace {

constexpr uint32_t kBlock = 4;

class BlockBroadcastTest : public testing::Test {
 protected:
  std::unique_ptr<BlockBroadcast::Listener> Listen() {
    return *broadcast_.Subscribe([this] { ++wake_count_; });
  }

  void PublishAndDeliver(int block_count) {
    for (int i = 0; i < block_count; ++i) {
      const std::vector<float> samples(kBlock, static_cast<float>(next_block_));
      broadcast_.Publish(next_block_ * kBlock, samples);
      ++next_block_;
    }
    broadcast_.Deliver();
  }

  /// First frames of all blocks that wait.
  static std::vector<uint64_t> TakeAll(BlockBroadcast::Listener& listener) {
    std::vector<uint64_t> first_frames;
    while (const auto block = listener.TryTake()) {
      const uint64_t number = block->first_frame / kBlock;
      EXPECT_EQ(block->samples, std::vector<float>(kBlock, static_cast<float>(number)));
      first_frames.push_back(block->first_frame);
    }
    return first_frames;
  }

  BlockBroadcast broadcast_{DeviceFormat{.block_frame_count = kBlock}, 3};
  uint64_t next_block_ = 0;
  int wake_count_ = 0;
};

TEST_F(BlockBroadcastTest, EveryListenerHearsEveryBlock) {
  const auto one = Listen();
  const auto two = Listen();
  PublishAndDeliver(2);
  PublishAndDeliver(1);
  EXPECT_THAT(TakeAll(*one), testing::ElementsAre(0, 4, 8));
  EXPECT_THAT(TakeAll(*two), testing::ElementsAre(0, 4, 8));
  EXPECT_EQ(wake_count_, 4);
}

TEST_F(BlockBroadcastTest, OneThatDoesNotReadLosesWholeBlocksAndIsTold) {
  const auto slow = Listen();
  const auto quick = Listen();
  for (int i = 0; i < 5; ++i) {
    PublishAndDeliver(1);
    EXPECT_EQ(TakeAll(*quick).size(), 1U);
  }
  EXPECT_THAT(TakeAll(*slow), testing::ElementsAre(0, 4, 8));
  EXPECT_EQ(slow->lost_frame_count(), 8U);
  EXPECT_EQ(quick->lost_frame_count(), 0U);
}

TEST_F(BlockBroadcastTest, WhatCouldNotBeDeliveredInTimeIsCountedAsLost) {
  const auto listener = Listen();
  PublishAndDeliver(1);
  PublishAndDeliver(5);  // the ring holds three
  EXPECT_THAT(TakeAll(*listener), testing::ElementsAre(0, 4, 8));
  PublishAndDeliver(1);
  EXPECT_THAT(TakeAll(*listener), testing::ElementsAre(24));
  EXPECT_EQ(listener->lost_frame_count(), 3 * kBlock);
}

TEST_F(BlockBroadcastTest, TheLimitIsOnThoseThatListenNow) {
  std::vector<std::unique_ptr<BlockBroadcast::Listener>> listeners;
  for (size_t i = 0; i < BlockBroadcast::kMaxListenerCount; ++i) listeners.push_back(Listen());
  const absl::Status refused = broadcast_.Subscribe([] {}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.ToString(), testing::HasSubstr("TOO_MANY_CALLS: "));
  listeners.pop_back();
  EXPECT_TRUE(broadcast_.Subscribe([] {}).ok());
}

}  // namespace
}  // namespace carillon
