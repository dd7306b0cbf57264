// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/look_ahead.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

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

/// A look-ahead of four blocks, which its thread has filled.
class LookAheadTest : public testing::TestWithParam<uint32_t> {
 protected:
  ManualClock clock_;
  const uint32_t channel_count_ = GetParam();
  LookAhead look_ahead_{
      {.sample_rate_hz = 48000, .block_frame_count = 16, .channel_count = channel_count_},
      4,
      Ramp(),
      clock_};
};

INSTANTIATE_TEST_SUITE_P(MonoAndStereo, LookAheadTest, testing::Values(1U, 2U));

TEST_P(LookAheadTest, IsFullBeforeTheFirstPullAndThenCountsTheFramesThatItCouldNotGive) {
  EXPECT_DOUBLE_EQ(look_ahead_.latency_s(), 4 * 16 / 48000.0);
  look_ahead_.Start().IgnoreError();
  look_ahead_.Stop();
  std::vector<float> samples(size_t{64} * channel_count_);
  look_ahead_.source().Pull(samples);
  for (size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(samples[i], static_cast<float>(i + 1));
  EXPECT_EQ(look_ahead_.xrun_count(), 0U);
  std::vector<float> rest(size_t{100} * channel_count_, 7.0F);
  while (look_ahead_.xrun_count() == 0) {
    look_ahead_.source().Pull(rest);  // the thread may have run once more
  }
  EXPECT_EQ(rest.back(), 0.0F);
  EXPECT_EQ(look_ahead_.xrun_count(), 1U);
  EXPECT_GT(look_ahead_.lost_frame_count(), 0U);
  EXPECT_LE(look_ahead_.lost_frame_count(), 100U);
}

TEST_P(LookAheadTest, LosesNoFrameBetweenRendererAndDevice) {
  look_ahead_.Start().IgnoreError();
  std::vector<float> heard;
  std::vector<float> samples(size_t{24} * channel_count_);
  while (heard.size() < size_t{4800} * channel_count_) {
    const uint64_t lost = look_ahead_.lost_frame_count();
    look_ahead_.source().Pull(samples);
    const uint64_t given = 24 - (look_ahead_.lost_frame_count() - lost);
    heard.insert(heard.end(), samples.begin(),
                 samples.begin() + static_cast<ptrdiff_t>(given * channel_count_));
  }
  look_ahead_.Stop();
  for (size_t i = 0; i < heard.size(); ++i) ASSERT_EQ(heard[i], static_cast<float>(i + 1));
}

}  // namespace
}  // namespace carillon
