// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/clocked_device.h"

#include <gtest/gtest.h>

#include <latch>
#include <numeric>
#include <vector>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

/// Counts frames as samples, notes when each pull came, and opens its latch after enough of them.
class RampSource final : public FrameSource {
 public:
  RampSource(Clock& clock, size_t pull_count) : clock_(clock), wanted_(pull_count) {}

  void Pull(std::span<float> frames) noexcept override {
    if (pull_times.size() >= wanted_) return;
    std::iota(frames.begin(), frames.end(), next_);
    next_ += static_cast<float>(frames.size());
    pull_times.push_back(clock_.Monotonic());
    if (pull_times.size() == wanted_) done.count_down();
  }

  std::vector<std::chrono::nanoseconds> pull_times;
  std::latch done{1};

 private:
  Clock& clock_;
  size_t wanted_;
  float next_ = 0;
};

TEST(ClockedDevice, PullsOneBlockWheneverOneHasPassed) {
  ManualClock clock;
  RampSource source(clock, 1000);
  ClockedDevice device("null", {.sample_rate_hz = 44100, .block_frame_count = 128}, clock, nullptr);
  ASSERT_TRUE(device.Start(source).ok());
  source.done.wait();
  device.Stop();
  for (size_t i = 0; i < source.pull_times.size(); ++i) {
    EXPECT_EQ(source.pull_times[i], std::chrono::nanoseconds(i * 128 * 1'000'000'000 / 44100));
  }
}

TEST(ClockedDevice, GivesItsSinkEveryFrameInOrder) {
  ManualClock clock;
  RampSource source(clock, 50);
  std::vector<float> heard;
  ClockedDevice device("sink", {.sample_rate_hz = 48000, .block_frame_count = 64}, clock,
                       [&heard](std::span<const float> block) {
                         heard.insert(heard.end(), block.begin(), block.end());
                         return heard.size() < 50 * 64;
                       });
  ASSERT_TRUE(device.Start(source).ok());
  source.done.wait();
  device.Stop();
  ASSERT_EQ(heard.size(), 50 * 64);
  for (size_t i = 0; i < heard.size(); ++i) EXPECT_EQ(heard[i], static_cast<float>(i));
}

TEST(ClockedDevice, IsDeadOnceItsSinkDeclines) {
  ManualClock clock;
  RampSource source(clock, 1);
  std::latch declined{1};
  ClockedDevice device("sink", {}, clock, [&declined](std::span<const float>) {
    declined.count_down();
    return false;
  });
  EXPECT_TRUE(device.alive());
  ASSERT_TRUE(device.Start(source).ok());
  declined.wait();
  device.Stop();
  EXPECT_FALSE(device.alive());
}

}  // namespace
}  // namespace carillon
