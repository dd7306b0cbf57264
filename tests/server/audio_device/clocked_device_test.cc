// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/clocked_device.h"

#include <gtest/gtest.h>

#include <latch>
#include <thread>
#include <vector>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

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
