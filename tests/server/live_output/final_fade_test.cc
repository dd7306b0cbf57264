// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/final_fade.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace carillon {
namespace {

constexpr DeviceFormat kStereo{
    .sample_rate_hz = 48000, .block_frame_count = 128, .channel_count = 2};

std::vector<float> Ones() { return std::vector<float>(kStereo.block_size(), 1.0F); }

TEST(FinalFade, FallsWithoutAStepToSilenceWithin50Ms) {
  FinalFade fade(kStereo);
  std::vector<float> before = Ones();
  fade.Apply(before);
  EXPECT_EQ(before, Ones());
  EXPECT_FALSE(fade.ended());
  fade.Begin();
  float last = 1;
  size_t sounding_frame_count = 0;
  while (!fade.ended()) {
    std::vector<float> block = Ones();
    fade.Apply(block);
    for (size_t i = 0; i < block.size(); i += 2) {
      EXPECT_EQ(block[i], block[i + 1]);  // both channels fade alike
      // The steepest slope of a raised cosine is pi/2 over its length.
      EXPECT_LE(std::abs(block[i] - last), 1.6 / 2400);
      last = block[i];
      if (last > 0) ++sounding_frame_count;
    }
  }
  EXPECT_EQ(last, 0);
  EXPECT_LE(sounding_frame_count, 2400U);
  EXPECT_GE(sounding_frame_count, 2390U);  // the last ones are below the smallest float's step
}

}  // namespace
}  // namespace carillon
