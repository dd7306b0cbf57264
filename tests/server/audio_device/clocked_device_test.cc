// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/clocked_device.h"

#include <gtest/gtest.h>

#include <latch>
#include <numeric>
#include <thread>
#include <vector>

#include "server/audio_device/frame_ring.h"
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
                         if (heard.size() < 50 * 64) {
                           heard.insert(heard.end(), block.begin(), block.end());
                         }
                         return absl::OkStatus();
                       });
  ASSERT_TRUE(device.Start(source).ok());
  source.done.wait();
  device.Stop();
  ASSERT_EQ(heard.size(), 50 * 64);
  for (size_t i = 0; i < heard.size(); ++i) EXPECT_EQ(heard[i], static_cast<float>(i));
}

TEST(ClockedDevice, CountsTheFramesThatItsSinkRefusesAndGoesOn) {
  ManualClock clock;
  RampSource source(clock, 1000);
  int given_count = 0;
  std::latch refused{1};
  std::latch taken{1};
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

TEST(ClockedDevice, KeepsTimeWithSilenceThatIsCountedIfFramesAreNotReady) {
  constexpr DeviceFormat kFormat{.block_frame_count = 64};
  ManualClock clock;
  FrameRing ring(kFormat, 4);
  const std::vector<float> ones(4 * kFormat.block_size(), 1.0F);
  ring.frames().Push(ones);
  std::vector<float> heard;
  std::latch enough{1};
  ClockedDevice device("sink", kFormat, clock, [&](std::span<const float> block) {
    heard.insert(heard.end(), block.begin(), block.end());
    if (heard.size() == 20 * kFormat.block_size()) enough.count_down();
    return absl::OkStatus();
  });
  ASSERT_TRUE(device.Start(ring).ok());
  enough.wait();
  device.Stop();
  EXPECT_EQ(std::accumulate(heard.begin(), heard.end(), 0.0F), static_cast<float>(ones.size()));
  EXPECT_EQ(ring.lost_frame_count(), heard.size() - ones.size());
  EXPECT_EQ(device.lost_frame_count(), 0U);  // the source's count is added to the device's
}

}  // namespace
}  // namespace carillon
