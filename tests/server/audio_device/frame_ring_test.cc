// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/frame_ring.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <vector>

namespace carillon {
namespace {

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
