// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/output_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

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
  for (const LossKind kind : {LossKind::kAnyLength, LossKind::kWholeCycles}) {
    OutputClock clock(kRateHz, kind);
    Device device(clock);
    const auto jitter = [](int i) { return i % 7 == 0 ? 300 : 2; };
    device.Run(200, jitter);
    device.Cycle(700, false);  // more than a cycle
    device.Cycle(20, true);    // of which JACK tells in the next
    device.Run(200, jitter);
    EXPECT_EQ(clock.xrun_count(), 1U);
    EXPECT_EQ(clock.lost_frame_count(), 0U);
  }
}

TEST(OutputClock, AnXrunIsCountedOnceHoweverManyBlocksItsCycleHas) {
  for (const size_t blocks : {1U, 4U, 16U}) {
    OutputClock clock(kRateHz, LossKind::kWholeCycles);
    Device device(clock, blocks);
    device.Run(100);
    device.Cycle(0, true);
    device.Run(100);
    device.Cycle(0, true);
    EXPECT_EQ(clock.xrun_count(), 2U) << blocks;
  }
}

TEST(OutputClock, CyclesThatJackRanAloneAreLost) {
  OutputClock clock(kRateHz, LossKind::kWholeCycles);
  Device device(clock);
  const auto jitter = [](int i) { return i % 5; };
  device.Run(200, jitter);
  device.Lose(3 * 512);
  device.Cycle(263, false);  // late for the fourth
  device.Cycle(0, true);
  device.Run(90, jitter);
  EXPECT_EQ(clock.lost_frame_count(), 0U);  // not known yet
  device.Run(10, jitter);
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512);
  device.Run(500, jitter);
  EXPECT_EQ(clock.lost_frame_count(), 3U * 512);
}

/// By how much JACK's loop is still off some cycles after its server was late by one frame: a loop
/// of second order with a bandwidth of 1/8 Hz.
double LeftOf(double cycles, double cycle_frames) {
  const double x = std::sqrt(2.0) / 2 * 2 * std::numbers::pi / 8 * cycles * cycle_frames / kRateHz;
  return std::exp(-x) * (std::cos(x) - std::sin(x));
}

TEST(OutputClock, WhereJacksServerWasLateNothingIsLost) {
  for (const size_t blocks : {1U, 4U}) {
    const double cycle_frames = static_cast<double>(blocks * kBlock);
    for (const double late_frames : {27.0, 110.0, 450.0, 1700.0}) {
      OutputClock clock(kRateHz, LossKind::kWholeCycles);
      Device device(clock, blocks);
      device.Run(500);
      device.Cycle(late_frames, false);
      device.Cycle(late_frames, true);
      device.Run(900, [&](int i) { return late_frames * LeftOf(i, cycle_frames); });
      EXPECT_EQ(clock.xrun_count(), 1U);
      EXPECT_EQ(clock.lost_frame_count(), 0U) << late_frames << " of cycles of " << cycle_frames;
    }
  }
}

TEST(OutputClock, OfADeviceThatStoodStillTheSilenceIsLost) {
  OutputClock clock(kRateHz, LossKind::kAnyLength);
  Device device(clock);
  device.Run(200);
  device.Lose(777);
  device.Cycle(0, true);
  device.Run(200);
  EXPECT_EQ(clock.lost_frame_count(), 777U);
}

TEST(OutputClock, ASoundCardThatDriftsLosesNothingByIt) {
  OutputClock clock(kRateHz, LossKind::kAnyLength);
  Device device(clock);
  const auto drift = [](int i) { return 0.1 * i; };  // 200 ppm
  device.Run(340000, drift);                         // an hour
  device.Cycle(drift(340000), true);
  device.Run(1000, [&](int i) { return drift(340001 + i); });
  EXPECT_EQ(clock.lost_frame_count(), 0U);
  device.Lose(700);
  device.Cycle(drift(341001), true);
  device.Run(100, [&](int i) { return drift(341002 + i); });
  EXPECT_EQ(clock.xrun_count(), 2U);
  // It drifts by 10 frames in a second, and the usual is up to a second old.
  EXPECT_NEAR(static_cast<double>(clock.lost_frame_count()), 700, 20);
}

}  // namespace
}  // namespace carillon
