// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/mixer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

using testing::HasSubstr;

constexpr double kDt = 1 / kTestSampleRateHz;

/// A mixer with one bank of one mode, and a stream to strike it.
class MixerTest : public testing::Test {
 protected:
  static constexpr double kSigma = -30;

  std::unique_ptr<OscillatorBank> MakeBank(double coupling = 20) {
    return std::make_unique<OscillatorBank>(
        SoundingModes{.modes = {MakeMode(0, 440, kSigma, coupling)}}, MakeUniformShapes(1),
        OscillatorBankSettings{});
  }

  void Strike(BankId bank, uint64_t frame, float fraction = 0, float newton_seconds = 1) {
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.impulse_newton_seconds[0] = newton_seconds;
    stream_->TryPush({.bank = bank, .frame = frame, .fraction = fraction, .action = impulse});
  }

  std::vector<float> Render(size_t block_count) {
    std::vector<float> frames(128 * block_count);
    mixer_.Render(frames);
    return frames;
  }

  /// The sound of one impulse on the bank.
  static double Right(size_t n, double strike_frame, double coupling = 20) {
    return ClosedForm(MakeMode(0, 440, kSigma, coupling), 1,
                      (static_cast<double>(n) - strike_frame) * kDt);
  }

  Mixer mixer_;
  BankId bank_ = mixer_.Add(MakeBank()).value();
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(8).value();
};

TEST_F(MixerTest, AStrikeSoundsFromItsFrameOn) {
  Strike(bank_, 300, 0.25F);
  const auto frames = Render(20);
  for (size_t n = 0; n < frames.size(); ++n) EXPECT_NEAR(frames[n], Right(n, 300.25), 1e-6) << n;
  EXPECT_EQ(stream_->accepted_count(), 1u);
  EXPECT_EQ(stream_->late_count(), 0u);
}

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

TEST_F(MixerTest, AStrikeBetweenTheLastSampleOfABlockAndTheNextBelongsToTheNext) {
  Strike(bank_, 127, 0.5F);
  const auto frames = Render(2);
  for (size_t n = 0; n < frames.size(); ++n) EXPECT_NEAR(frames[n], Right(n, 127.5), 1e-6) << n;
}

TEST_F(MixerTest, StrikesSoundInOrderOfTimeWhateverTheirOrderOfArrival) {
  Strike(bank_, 500);
  Strike(bank_, 20, 0.5F);
  Strike(bank_, 100);
  const auto frames = Render(10);
  for (size_t n = 0; n < frames.size(); ++n) {
    EXPECT_NEAR(frames[n], Right(n, 500) + Right(n, 20.5) + Right(n, 100), 1e-6) << n;
  }
}

TEST_F(MixerTest, ALateStrikeSoundsAtOnceAndIsCounted) {
  Render(3);
  Strike(bank_, 10);
  const auto frames = Render(3);
  for (size_t n = 0; n < frames.size(); ++n) EXPECT_NEAR(frames[n], Right(n, 0), 1e-6) << n;
  EXPECT_EQ(stream_->late_count(), 1u);
  EXPECT_EQ(mixer_.statistics().late_count, 1u);
  EXPECT_EQ(mixer_.statistics().accepted_count, 0u);
}

TEST_F(MixerTest, OneCallOverManyBlocksGivesTheBitsOfManyCalls) {
  Mixer other;
  const BankId bank = other.Add(MakeBank()).value();
  const auto stream = other.OpenStream(8).value();
  for (const uint64_t frame : {3U, 130U, 131U, 1000U}) {
    Strike(bank_, frame, 0.3F);
    stream->TryPush({.bank = bank, .frame = frame, .fraction = 0.3F, .action = MakeUnitImpulse()});
  }
  std::vector<float> whole(128 * 16), parts;
  other.Render(whole);
  for (int i = 0; i < 16; ++i) {
    const auto part = Render(1);
    parts.insert(parts.end(), part.begin(), part.end());
  }
  EXPECT_EQ(whole, parts);
}

/// Sixty objects with impulses, rendered by `thread_count` threads.
std::vector<float> RenderBy(size_t thread_count) {
  RenderThreads threads(thread_count);
  Mixer mixer({.most_banks = 60, .threads = &threads});
  const auto stream = mixer.OpenStream().value();
  for (uint32_t i = 0; i < 60; ++i) {
    SoundingModes sounding;
    for (uint32_t m = 0; m < 150; ++m) {
      sounding.modes.push_back(MakeMode(m, 60 + 97 * m + i, -1 - 0.3 * (m * 7 % 150)));
    }
    const BankId bank = mixer
                            .Add(std::make_unique<OscillatorBank>(
                                sounding, MakeUniformShapes(150, 1e-2F), OscillatorBankSettings{}))
                            .value();
    for (uint64_t k = 0; k < 20; ++k) {
      stream->TryPush({.bank = bank,
                       .frame = (i * 131 + k * 977) % 12000,
                       .fraction = 0.4F,
                       .action = MakeUnitImpulse()});
    }
  }
  std::vector<float> sound(size_t{128} * 120);
  mixer.Render(sound);
  return sound;
}

TEST(MixerThreads, TheSoundIsTheSameBitForBitFromRunToRunAndForAnyNumberOfThreads) {
  const std::vector<float> alone = RenderBy(1);
  EXPECT_GT(Rms(alone), 0);
  for (const size_t thread_count : {1U, 2U, 3U, 7U}) EXPECT_EQ(RenderBy(thread_count), alone);
}

TEST_F(MixerTest, ABankLetRingOutSoundsToItsEndAndIsThenFreed) {
  Strike(bank_, 0);
  Strike(bank_, 6000);  // on its way when the bank is let ring out
  Render(1);
  mixer_.LetRingOut(bank_);
  const auto frames = Render(60);
  for (size_t n = 0; n < frames.size(); ++n) {
    EXPECT_NEAR(frames[n], Right(n + 128, 0) + Right(n + 128, 6000), 1e-6) << n;
  }
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
  const auto frames = Render(2);
  for (size_t n = 0; n < frames.size(); ++n) EXPECT_NEAR(frames[n], Right(n, 10), 1e-6) << n;
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
    EXPECT_NEAR(frames[n], gain * Right(n + 256, 0), 1e-5) << n;
  }
  EXPECT_EQ(mixer_.statistics().bank_count, 0u);
  EXPECT_EQ(mixer_.statistics().dropped_count, 1u);
}

TEST_F(MixerTest, AFreedSlotServesAnotherBankUnderAnotherName) {
  Mixer mixer({.most_banks = 1});
  const BankId first = mixer.Add(MakeBank()).value();
  EXPECT_THAT(mixer.Add(MakeBank()).status().ToString(), HasSubstr("TOO_MANY_OBJECTS"));
  mixer.FadeOut(first);
  mixer.FadeOut(first);
  mixer.LetRingOut(first);
  std::vector<float> block(128);
  mixer.Render(block);
  mixer.CollectGarbage();
  const auto second = mixer.Add(MakeBank());
  ASSERT_TRUE(second.ok());
  EXPECT_NE(*second, first);
  mixer.FadeOut(first);  // the old name means nothing any more
  mixer.Render(block);
  EXPECT_EQ(mixer.statistics().bank_count, 1u);
}

TEST_F(MixerTest, AClosedStreamMakesRoomForAnotherAndWhatItPushedStillSounds) {
  Mixer mixer({.most_streams = 1});
  const BankId bank = mixer.Add(MakeBank()).value();
  auto stream = mixer.OpenStream().value();
  EXPECT_THAT(mixer.OpenStream().status().ToString(), HasSubstr("TOO_MANY_STREAMS"));
  stream->TryPush({.bank = bank, .action = MakeUnitImpulse()});
  stream.reset();
  std::vector<float> block(128);
  mixer.Render(block);
  mixer.CollectGarbage();
  EXPECT_NEAR(block[100], Right(100, 0), 1e-6);
  EXPECT_TRUE(mixer.OpenStream().ok());
}

TEST_F(MixerTest, WhatIsNotFiniteNeverLeaves) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const BankId broken = mixer_.Add(MakeBank(std::numeric_limits<double>::quiet_NaN())).value();
  Strike(bank_, 0);
  Strike(bank_, 50, 0, kNan);
  Strike(bank_, 60, 0, std::numeric_limits<float>::infinity());
  Strike(broken, 70);
  const auto frames = Render(4);
  for (size_t n = 0; n < frames.size(); ++n) EXPECT_NEAR(frames[n], Right(n, 0), 1e-6) << n;
  EXPECT_EQ(mixer_.statistics().dropped_count, 3u);
}

TEST_F(MixerTest, ABankWhoseStateRunsAwayIsResetAndCounted) {
  // A mode that grows, which no material gives.
  const BankId bank =
      mixer_
          .Add(std::make_unique<OscillatorBank>(SoundingModes{.modes = {MakeMode(0, 440, 40000)}},
                                                MakeUniformShapes(1), OscillatorBankSettings{}))
          .value();
  Strike(bank, 0);
  for (const float x : Render(3)) EXPECT_LE(std::abs(x), 1.0F);
  EXPECT_EQ(mixer_.statistics().reset_bank_count, 1u);
  EXPECT_EQ(mixer_.statistics().active_mode_count, 0u);
}

TEST_F(MixerTest, TellsFramesPeakAndWhatTheLimiterDid) {
  Strike(bank_, 0, 0, 100);
  const auto frames = Render(2);
  double peak = 0;
  for (size_t n = 0; n < 256; ++n) peak = std::max(peak, std::abs(100 * Right(n, 0)));
  EXPECT_GT(peak, 1);
  EXPECT_NEAR(mixer_.TakePeak(), peak, 1e-5 * peak);
  EXPECT_EQ(mixer_.TakePeak(), 0);
  EXPECT_GT(mixer_.statistics().limited_frame_count, 0u);
  EXPECT_EQ(mixer_.statistics().active_mode_count, 1u);
  EXPECT_EQ(mixer_.frame(), 256u);
  for (const float x : frames) EXPECT_LE(std::abs(x), 1.0F);
}

}  // namespace
}  // namespace carillon
