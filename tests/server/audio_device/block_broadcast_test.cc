// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/block_broadcast.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <latch>
#include <thread>
#include <vector>

#include "server/audio_device/clocked_device.h"
#include "tests/server/audio_device/manual_clock.h"

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

/// Notes when each pull came, and opens its latch after enough of them.
class TimedSource final : public FrameSource {
 public:
  TimedSource(Clock& clock, size_t pull_count) : clock_(clock), wanted_(pull_count) {}

  void Pull(std::span<float> /*frames*/) noexcept override {
    if (pull_times.size() >= wanted_) return;
    pull_times.push_back(clock_.Monotonic());
    if (pull_times.size() == wanted_) done.count_down();
  }

  std::vector<std::chrono::nanoseconds> pull_times;
  std::latch done{1};

 private:
  Clock& clock_;
  size_t wanted_;
};

TEST(ClockedDevice, PullsOneBlockWheneverOneHasPassed) {
  ManualClock clock;
  TimedSource source(clock, 1000);
  ClockedDevice device("null", {.sample_rate_hz = 44100, .block_frame_count = 128}, clock, nullptr);
  ASSERT_TRUE(device.Start(source).ok());
  source.done.wait();
  device.Stop();
  for (size_t i = 0; i < source.pull_times.size(); ++i) {
    EXPECT_EQ(source.pull_times[i], std::chrono::nanoseconds(i * 128 * 1'000'000'000 / 44100));
  }
}

TEST(ClockedDevice, CountsTheFramesThatItsSinkRefusesAndGoesOn) {
  ManualClock clock;
  TimedSource source(clock, 1000);
  int given_count = 0;
  std::latch refused{1}, taken{1};
  ClockedDevice device("sink", {.block_frame_count = 64}, clock, [&](std::span<const float>) {
    if (++given_count == 10) refused.wait();
    if (given_count == 11) taken.count_down();
    return given_count < 10 ? absl::DataLossError("full") : absl::OkStatus();
  });
  EXPECT_TRUE(device.Check().ok());
  ASSERT_TRUE(device.Start(source).ok());
  while (device.lost_frame_count() < 9 * 64) std::this_thread::yield();
  EXPECT_EQ(device.Check(), absl::DataLossError("full"));
  refused.count_down();
  taken.wait();
  device.Stop();
  EXPECT_TRUE(device.Check().ok());
  EXPECT_EQ(device.lost_frame_count(), 9U * 64);
}

}  // namespace
}  // namespace carillon
