// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/mixer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "server/synthesis/limiter.h"
#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

using testing::HasSubstr;

const SoundingMode kMode = MakeMode(0, 440, -30, 20);

/// A mixer with one bank of one mode, and a stream to strike it.
class MixerTest : public testing::Test {
 protected:
  void Strike(BankId bank, uint64_t frame, float fraction = 0, float newton_seconds = 1) {
    carillon::Strike(*stream_, bank, frame, fraction, newton_seconds);
  }

  std::vector<float> Render(size_t block_count) {
    return carillon::Render(mixer_, block_count, block_count);
  }

  Mixer mixer_;
  BankId bank_ = mixer_.Add(MakeBank({kMode})).value();
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(8).value();
};

TEST_F(MixerTest, ABlowBeyondAllBoundsIsLoweredWithinABlock) {
  Strike(bank_, 0, 0, 1);
  Render(1);
  const double ordinary = mixer_.TakePeak();
  ASSERT_LT(ordinary, kMostAmplitude);
  Render(1);
  EXPECT_EQ(mixer_.statistics().bounded_bank_count, 0u);
  Strike(bank_, 256, 0, static_cast<float>(1e12 / ordinary));
  Render(1);
  EXPECT_GT(mixer_.TakePeak(), 1e11);
  EXPECT_EQ(mixer_.statistics().bounded_bank_count, 1u);
  Render(1);
  EXPECT_NEAR(mixer_.TakePeak(), kMostAmplitude, 0.1 * kMostAmplitude);
  const auto later = Render(1000);
  EXPECT_EQ(mixer_.statistics().bounded_bank_count, 1u);
  EXPECT_EQ(mixer_.statistics().reset_bank_count, 0u);
  // It decays from there as from any blow: 16 exp(-30 t).
  EXPECT_LT(std::abs(later.back()), 1e-6);
}

TEST_F(MixerTest, StrikesSoundInOrderOfTimeWhateverTheirOrderOfArrival) {
  Strike(bank_, 500);
  Strike(bank_, 20, 0.5F);
  Strike(bank_, 127, 0.5F);  // after the last sample of a block, thus of the next
  Strike(bank_, 300, 0.25F);
  ExpectStrikes(Render(20), kMode, 0, {20.5, 127.5, 300.25, 500});
  EXPECT_EQ(stream_->accepted_count(), 4u);
  EXPECT_EQ(stream_->late_count(), 0u);
}

TEST_F(MixerTest, ALateStrikeSoundsAtOnceAndIsCounted) {
  Render(3);
  Strike(bank_, 10);
  ExpectStrikes(Render(3), kMode, 0, {0});
  EXPECT_EQ(stream_->late_count(), 1u);
  EXPECT_EQ(mixer_.statistics().late_count, 1u);
  EXPECT_EQ(mixer_.statistics().accepted_count, 0u);
}

TEST_F(MixerTest, ABankLetRingOutSoundsToItsEndAndIsThenFreed) {
  Strike(bank_, 0);
  Strike(bank_, 6000);  // on its way when the bank is let ring out
  Render(1);
  mixer_.LetRingOut(bank_);
  ExpectStrikes(Render(60), kMode, 128, {0, 6000});
  EXPECT_EQ(mixer_.statistics().bank_count, 1u);
  Render(500);  // -140 dB at -30 1/s: 0.54 s, 202 blocks
  EXPECT_EQ(mixer_.statistics().bank_count, 0u);
  mixer_.CollectGarbage();
  Strike(bank_, 0);
  Render(1);
  EXPECT_EQ(stream_->dropped_count(), 1u);
}

TEST_F(MixerTest, AStrikePushedJustBeforeItsBankIsLetRingOutStillSounds) {
  Strike(bank_, 10);
  mixer_.LetRingOut(bank_);
  ExpectStrikes(Render(2), kMode, 0, {10});
}

TEST_F(MixerTest, ABankFadedOutIsSilentAfterTenMillisecondsWithoutAJump) {
  Strike(bank_, 0);
  Strike(bank_, 300);  // lost: it fades
  Render(2);
  mixer_.FadeOut(bank_);
  const auto frames = Render(6);
  for (size_t n = 0; n < frames.size(); ++n) {
    const double gain = std::max(0.0, 1 - static_cast<double>(n + 1) / 480);
    // The ramp is a sum of 480 rounded steps.
    EXPECT_NEAR(frames[n], gain * SumOfStrikes({.modes = {kMode}}, {0}, n + 256), 1e-5) << n;
  }
  EXPECT_EQ(mixer_.statistics().bank_count, 0u);
  EXPECT_EQ(mixer_.statistics().dropped_count, 1u);
}

TEST_F(MixerTest, AFreedSlotServesAnotherBankUnderAnotherName) {
  Mixer mixer({.most_banks = 1});
  const BankId first = mixer.Add(MakeBank({kMode})).value();
  EXPECT_THAT(mixer.Add(MakeBank({kMode})).status().ToString(), HasSubstr("TOO_MANY_OBJECTS"));
  mixer.FadeOut(first);
  mixer.FadeOut(first);
  mixer.LetRingOut(first);
  carillon::Render(mixer, 1);
  mixer.CollectGarbage();
  const auto second = mixer.Add(MakeBank({kMode}));
  ASSERT_TRUE(second.ok());
  EXPECT_NE(*second, first);
  mixer.FadeOut(first);  // the old name means nothing any more
  carillon::Render(mixer, 1);
  EXPECT_EQ(mixer.statistics().bank_count, 1u);
}

TEST_F(MixerTest, AClosedStreamMakesRoomForAnotherAndWhatItPushedStillSounds) {
  Mixer mixer({.most_streams = 1});
  const BankId bank = mixer.Add(MakeBank({kMode})).value();
  auto stream = mixer.OpenStream().value();
  EXPECT_THAT(mixer.OpenStream().status().ToString(), HasSubstr("TOO_MANY_STREAMS"));
  carillon::Strike(*stream, bank);
  stream.reset();
  ExpectStrikes(carillon::Render(mixer, 1), kMode, 0, {0});
  mixer.CollectGarbage();
  EXPECT_TRUE(mixer.OpenStream().ok());
}

TEST_F(MixerTest, WhatIsNotFiniteNeverLeaves) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const BankId broken = mixer_.Add(MakeBank({MakeMode(0, 440, -30, double{kNan})})).value();
  Strike(bank_, 0);
  Strike(bank_, 50, 0, kNan);
  Strike(bank_, 60, 0, std::numeric_limits<float>::infinity());
  Strike(broken, 70);
  ExpectStrikes(Render(4), kMode, 0, {0});
  EXPECT_EQ(mixer_.statistics().dropped_count, 3u);
}

TEST_F(MixerTest, ABankWhoseStateRunsAwayIsResetAndCounted) {
  // A mode that grows, which no material gives.
  const BankId bank = mixer_.Add(MakeBank({MakeMode(0, 440, 40000)})).value();
  Strike(bank, 0);
  EXPECT_LE(Peak(Render(3)), 1);
  EXPECT_EQ(mixer_.statistics().reset_bank_count, 1u);
  EXPECT_EQ(mixer_.statistics().active_mode_count, 0u);
}

TEST_F(MixerTest, TellsFramesPeakAndWhatTheLimiterDid) {
  Strike(bank_, 0, 0, 100);
  const auto frames = Render(2);
  double peak = 0;
  for (size_t n = 0; n < 256; ++n) {
    peak = std::max(peak, std::abs(100 * SumOfStrikes({.modes = {kMode}}, {0}, n)));
  }
  EXPECT_GT(peak, 1);
  EXPECT_NEAR(mixer_.TakePeak(), peak, 1e-5 * peak);
  EXPECT_EQ(mixer_.TakePeak(), 0);
  EXPECT_GT(mixer_.statistics().limited_frame_count, 0u);
  EXPECT_EQ(mixer_.statistics().active_mode_count, 1u);
  EXPECT_EQ(mixer_.frame(), 256u);
  EXPECT_LE(Peak(frames), 1);
}

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
