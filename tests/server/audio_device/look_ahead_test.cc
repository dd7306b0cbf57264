// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/look_ahead.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <numeric>
#include <vector>

#include "server/audio_device/frame_ring.h"
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

constexpr DeviceFormat kStereo{
    .sample_rate_hz = 48000, .block_frame_count = 16, .channel_count = 2};

TEST(FrameRing, FramesOfOneMappingArePulledFromTheOtherWhichCountsThoseThatItMissed) {
  FrameRing ring(kStereo, 4);
  const auto mapped = FrameRing::Map(dup(ring.shared_memory()));
  ASSERT_TRUE(mapped.ok()) << mapped.status();
  EXPECT_EQ((*mapped)->frames().capacity(), 4 * kStereo.block_size());
  ring.frames().Push(std::array{1.0F, 2.0F, 3.0F, 4.0F});
  std::vector<float> pulled(4);
  (*mapped)->Pull(pulled);
  EXPECT_EQ(pulled, (std::vector{1.0F, 2.0F, 3.0F, 4.0F}));
  EXPECT_EQ(ring.frames().free_count(), ring.frames().capacity());
  EXPECT_EQ(ring.xrun_count(), 0U);
  ring.frames().Push(std::array{1.0F, 2.0F});
  pulled.assign(6, 7.0F);
  (*mapped)->Pull(pulled);
  EXPECT_EQ(pulled, (std::vector{1.0F, 2.0F, 0.0F, 0.0F, 0.0F, 0.0F}));
  EXPECT_EQ(ring.xrun_count(), 1U);
  EXPECT_EQ(ring.lost_frame_count(), 2U);
}

TEST(FrameRing, RefusesMemoryThatIsNoRing) {
  for (const off_t byte_count : {0, 1, 4096}) {
    const int descriptor = memfd_create("no ring", MFD_CLOEXEC);
    ASSERT_EQ(ftruncate(descriptor, byte_count), 0);
    EXPECT_FALSE(FrameRing::Map(descriptor).ok()) << byte_count;
    close(descriptor);
  }
}

}  // namespace
}  // namespace carillon
