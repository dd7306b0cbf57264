// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/look_ahead.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <vector>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

constexpr DeviceFormat kFormat{.sample_rate_hz = 48000, .block_frame_count = 16};

/// Blocks whose samples count frames from 1.
class Ramp {
 public:
  void operator()(std::span<float> block) {
    std::iota(block.begin(), block.end(), static_cast<float>(next_));
    next_ += block.size();
  }

 private:
  size_t next_ = 1;
};

TEST(LookAhead, IsFullBeforeTheFirstPull) {
  ManualClock clock;
  LookAhead look_ahead(kFormat, 4, Ramp(), clock);
  look_ahead.Start().IgnoreError();
  look_ahead.Stop();
  std::vector<float> frames(64);
  look_ahead.source().Pull(frames);
  for (size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i], static_cast<float>(i + 1));
  EXPECT_EQ(look_ahead.xrun_count(), 0U);
}

TEST(LookAhead, CountsWhatItCouldNotGiveAndGivesSilence) {
  ManualClock clock;
  LookAhead look_ahead(kFormat, 4, Ramp(), clock);
  look_ahead.Start().IgnoreError();
  look_ahead.Stop();
  std::vector<float> frames(64);
  look_ahead.source().Pull(frames);
  std::vector<float> rest(100, 7.0F);
  while (look_ahead.xrun_count() == 0)
    look_ahead.source().Pull(rest);  // the thread may have run once more
  EXPECT_EQ(rest.back(), 0.0F);
  EXPECT_EQ(look_ahead.xrun_count(), 1U);
  EXPECT_GT(look_ahead.lost_frame_count(), 0U);
  EXPECT_LE(look_ahead.lost_frame_count(), 100U);
}

TEST(LookAhead, LosesNoFrameBetweenRendererAndDevice) {
  ManualClock clock;
  LookAhead look_ahead(kFormat, 4, Ramp(), clock);
  look_ahead.Start().IgnoreError();
  std::vector<float> heard;
  std::vector<float> frames(24);
  while (heard.size() < 4800) {
    const uint64_t lost = look_ahead.lost_frame_count();
    look_ahead.source().Pull(frames);
    const size_t given = frames.size() - (look_ahead.lost_frame_count() - lost);
    heard.insert(heard.end(), frames.begin(), frames.begin() + static_cast<ptrdiff_t>(given));
  }
  look_ahead.Stop();
  for (size_t i = 0; i < heard.size(); ++i) ASSERT_EQ(heard[i], static_cast<float>(i + 1));
}

TEST(LookAhead, InStereoCountsFramesNotSamples) {
  DeviceFormat stereo = kFormat;
  stereo.channel_count = 2;
  ManualClock clock;
  LookAhead look_ahead(stereo, 4, Ramp(), clock);
  EXPECT_DOUBLE_EQ(look_ahead.latency_s(), 4 * 16 / 48000.0);
  look_ahead.Start().IgnoreError();
  look_ahead.Stop();
  std::vector<float> samples(2 * 64);
  look_ahead.source().Pull(samples);
  EXPECT_EQ(samples.back(), 128);
  std::vector<float> rest(2 * 100);
  while (look_ahead.xrun_count() == 0)
    look_ahead.source().Pull(rest);  // the thread may have run once more
  EXPECT_LE(look_ahead.lost_frame_count(), 100U);
}

TEST(LookAhead, StatesTheLatencyItAdds) {
  ManualClock clock;
  const LookAhead look_ahead(kFormat, 6, Ramp(), clock);
  EXPECT_DOUBLE_EQ(look_ahead.latency_s(), 6 * 16 / 48000.0);
}

}  // namespace
}  // namespace carillon
