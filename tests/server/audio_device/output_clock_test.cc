// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/output_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace carillon {
namespace {

constexpr double kRateHz = 48000;
constexpr size_t kBlock = 128;

/// A device that asks for its cycles in blocks, as PortAudio does of a host with longer ones.
class Device {
 public:
  explicit Device(OutputClock& clock, size_t blocks_in_cycle = 4)
      : clock_(clock), blocks_(blocks_in_cycle) {}

  /// So many cycles, each late by what `late_frames` says of its number.
  void Run(
      int cycles, const std::function<double(int)>& late_frames = [](int) { return 0; }) {
    for (int i = 0; i < cycles; ++i) Cycle(late_frames(i), false);
  }

  void Cycle(double late_frames, bool underflow) {
    const double cycle_s = (frame_ + late_frames) / kRateHz;
    for (size_t block = 0; block < blocks_; ++block) {
      const double output_s = cycle_s + static_cast<double>(1024 + block * kBlock) / kRateHz;
      clock_.Count(cycle_s, output_s, kBlock, underflow);
    }
    frame_ += static_cast<double>(blocks_ * kBlock);
  }

  /// Its time goes on without frames.
  void Lose(double frames) { frame_ += frames; }

 private:
  OutputClock& clock_;
  const size_t blocks_;
  double frame_ = 1e6;
};

TEST(OutputClock, ACycleThatCameLateLostNothing) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Run(200, [](int i) { return i % 7 == 0 ? 300 : 2; });
  device.Cycle(700, false);  // more than a cycle
  device.Cycle(20, true);    // of which JACK tells in the next
  device.Run(200, [](int i) { return i % 7 == 0 ? 300 : 2; });
  EXPECT_EQ(clock.xrun_count(), 1U);
  EXPECT_EQ(clock.lost_frame_count(), 0U);
}

TEST(OutputClock, AnXrunIsCountedOnceHoweverManyBlocksItsCycleHas) {
  for (const size_t blocks : {1U, 4U, 16U}) {
    OutputClock clock(kRateHz);
    Device device(clock, blocks);
    device.Run(100);
    device.Cycle(0, true);
    device.Run(100);
    device.Cycle(0, true);
    EXPECT_EQ(clock.xrun_count(), 2U) << blocks;
  }
}

TEST(OutputClock, CyclesThatTheDeviceRanAloneAreLost) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Run(200, [](int i) { return i % 5; });
  device.Lose(3 * 512);
  device.Cycle(263, false);  // late for the fourth
  device.Cycle(0, true);
  device.Run(20, [](int i) { return i % 5; });
  EXPECT_EQ(clock.lost_frame_count(), 0U);  // not known yet
  device.Run(100, [](int i) { return i % 5; });
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512);
  device.Run(500);
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512);
}

TEST(OutputClock, SeveralXrunsInARowAreMeasuredTogetherAndLaterOnesAnew) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Run(100);
  for (int i = 0; i < 3; ++i) {
    device.Lose(512);
    device.Cycle(0, false);
    device.Cycle(0, true);
    device.Run(10);
  }
  device.Run(100);
  EXPECT_EQ(clock.xrun_count(), 3U);
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512);
  device.Lose(100);
  device.Cycle(0, true);
  device.Run(100);
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512 + 100);
}

// As measured of JACK when the server itself had been stopped for 50 ms.
TEST(OutputClock, AClockThatFindsItsWayBackLostNothing) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Run(200);
  device.Cycle(1701, false);
  device.Cycle(1682, true);
  device.Run(400, [](int i) { return 1682 * std::exp(-0.012 * i); });
  EXPECT_EQ(clock.xrun_count(), 1U);
  EXPECT_EQ(clock.lost_frame_count(), 0U);
}

TEST(OutputClock, ASoundCardThatDriftsLosesNothingByIt) {
  OutputClock clock(kRateHz);
  Device device(clock);
  // 200 ppm, for an hour.
  const auto drift = [](int i) { return 0.1 * i; };
  device.Run(340000, drift);
  device.Lose(700);
  device.Cycle(0.1 * 340000, true);
  device.Run(100, [&](int i) { return drift(340001 + i); });
  EXPECT_EQ(clock.xrun_count(), 1U);
  // Within a watch it drifts by five frames.
  EXPECT_NEAR(static_cast<double>(clock.lost_frame_count()), 700, 8);
}

TEST(OutputClock, TimeThatBeginsAnewAsJacksDoesAfterADayIsNoLoss) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Run(100);
  device.Lose(-4294967296.0);
  device.Run(5);
  device.Cycle(0, true);
  device.Run(200);
  EXPECT_EQ(clock.lost_frame_count(), 0U);
  device.Lose(512);
  device.Cycle(0, true);
  device.Run(200);
  EXPECT_EQ(clock.lost_frame_count(), 512U);
}

TEST(OutputClock, WithoutAClockXrunsAreCountedAndLossesAreNot) {
  OutputClock clock(kRateHz);
  for (int i = 0; i < 1000; ++i) clock.Count(0, 0, kBlock, i == 300 || i == 600);
  EXPECT_EQ(clock.xrun_count(), 2U);
  EXPECT_EQ(clock.lost_frame_count(), 0U);
}

TEST(OutputClock, WhatIsSaidBeforeTheFirstFrameCountsNot) {
  OutputClock clock(kRateHz);
  Device device(clock);
  device.Cycle(0, true);
  EXPECT_EQ(clock.xrun_count(), 0U);
  device.Run(100);
  clock.Restart();
  device.Lose(48000);
  device.Cycle(0, true);
  device.Run(100);
  EXPECT_EQ(clock.xrun_count(), 0U);
  EXPECT_EQ(clock.lost_frame_count(), 0U);
}

}  // namespace
}  // namespace carillon
