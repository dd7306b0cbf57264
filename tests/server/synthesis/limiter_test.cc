// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/limiter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace carillon {
namespace {

std::vector<float> MakeSine(float amplitude, size_t frame_count = 48000) {
  std::vector<float> sine(frame_count);
  for (size_t n = 0; n < frame_count; ++n) {
    sine[n] = amplitude * std::sin(0.05F * static_cast<float>(n));
  }
  return sine;
}

TEST(Limiter, PassesWhatLiesBelowMinusThreeDecibelsBitForBit) {
  const auto sine = MakeSine(0.7079F);
  auto limited = sine;
  EXPECT_EQ(Limiter(48000).Apply(limited), 0u);
  EXPECT_EQ(limited, sine);
}

TEST(Limiter, NeverExceedsFullScale) {
  for (const float amplitude : {0.8F, 1.0F, 3.0F, 1e6F, std::numeric_limits<float>::max()}) {
    auto sine = MakeSine(amplitude);
    EXPECT_GT(Limiter(48000).Apply(sine), 0u);
    for (const float x : sine) ASSERT_LE(std::abs(x), 1.0F) << amplitude;
  }
}

TEST(Limiter, TheGainRecoversWithinASecond) {
  std::vector<float> loud(100, 4.0F), soft(48000, 0.1F);
  Limiter limiter(48000);
  limiter.Apply(loud);
  const uint64_t limited = limiter.Apply(soft);
  EXPECT_GT(limited, 0u);
  // ln(4 / 0.708) time constants of 0.1 s.
  EXPECT_NEAR(static_cast<double>(limited), 48000 * 0.1 * std::log(4 / 0.70795), 10);
  EXPECT_LT(soft[0], 0.03F);
  EXPECT_EQ(soft.back(), 0.1F);
}

TEST(Limiter, AllChannelsOfAFrameGetTheGainOfTheLoudest) {
  Limiter limiter(48000, 2);
  std::vector<float> frames = {2, 0.5F, 0.1F, -4, 0, 0.25F};
  EXPECT_EQ(limiter.Apply(frames), 3U);
  EXPECT_NEAR(frames[1] / frames[0], 0.25, 1e-6);
  EXPECT_NEAR(frames[2] / frames[3], -0.025, 1e-6);
  EXPECT_LE(std::abs(frames[3]), 1);
}

TEST(Limiter, WhatIsNotFiniteBecomesSilence) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<float> block{0.5F, kNan, kInfinity, -kInfinity, 0.5F};
  EXPECT_EQ(Limiter(48000).Apply(block), 3u);
  EXPECT_EQ(block, (std::vector<float>{0.5F, 0, 0, 0, 0.5F}));
}

}  // namespace
}  // namespace carillon
