// SPDX-License-Identifier: Apache-2.0
//
// Voices that are heard by two ears, and the head behind them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/server/synthesis/voice/heard.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

constexpr double kRate = SphereHead::kRate;
constexpr double kPi = std::numbers::pi;

const std::shared_ptr<const Head>& TheHead() {
  static const auto head = std::make_shared<const Head>(SphereHead::Make());
  return head;
}

Channels Play(const HearingSettings& hearing, const Vector3& from, const std::vector<float>& sound,
              const std::function<void(Voice&, size_t)>& at_block = {}, size_t block = 128,
              size_t channels = 2) {
  return Heard(hearing, {.position_m = from}, channels, TheHead(), block).Play(sound, at_block);
}

/// The frame of the peak, between frames by a parabola.
double PeakFrame(const std::vector<float>& sound) {
  const auto peak = std::ranges::max_element(sound, {}, [](float x) { return std::abs(x); });
  const double before = peak[-1], at = peak[0], after = peak[1];
  return static_cast<double>(peak - sound.begin()) +
         (before - after) / (2 * (before - 2 * at + after));
}

/// The level of a sound at a frequency, dB.
double LevelAt(const std::vector<float>& sound, double frequency_hz) {
  std::complex<double> sum = 0;
  for (size_t n = 0; n < sound.size(); ++n) {
    sum += double{sound[n]} *
           std::polar(1.0, -2 * kPi * frequency_hz / kRate * static_cast<double>(n));
  }
  return 20 * std::log10(std::abs(sum) + 1e-12);
}

/// Returns the greatest amplitude of a sound after a high pass, which shows steps. Eight
/// differences, each of gain 1 at half of the sample rate, leave 2e-13 of a tone of 400 Hz.
double FastestPart(const std::vector<float>& sound) {
  std::vector<double> left(sound.begin() + 2000, sound.end());
  for (int order = 0; order < 8; ++order) {
    for (size_t n = left.size() - 1; n > 0; --n) left[n] = (left[n] - left[n - 1]) / 2;
    left.erase(left.begin());
  }
  return Peak(left);
}

TEST(HeadTest, KeepsTheDelaysBetweenTheMeasuredDirections) {
  double before = TheHead()->Delays(At(0))[1];
  for (double degrees = 0; degrees < 360; degrees += 1) {
    const auto [left, right] = TheHead()->Delays(At(degrees));
    const double sine = std::sin(degrees * kPi / 180);
    const double difference = (SphereHead::DelayS(-sine) - SphereHead::DelayS(sine)) * kRate;
    EXPECT_NEAR(left - right, difference, 0.7) << degrees;
    EXPECT_NEAR(right, before, 0.7) << degrees;
    before = right;
  }
}

TEST(HeadTest, DoesNotCombBetweenTheMeasuredDirections) {
  // Halfway between measured directions, whose delays differ by two frames.
  for (const double frequency_hz : {1000.0, 4000.0, 8000.0, 12000.0}) {
    const auto level = [frequency_hz](double degrees) {
      EarResponses responses = TheHead()->Silent();
      TheHead()->Respond(At(degrees), responses);
      return LevelAt(responses[0].taps, frequency_hz);
    };
    EXPECT_NEAR(level(35), (level(30) + level(40)) / 2, 0.3) << frequency_hz;
  }
}

TEST(HeadTest, IsAsLoudFromStraightAheadAsPanningIs) {
  double power = 0;
  EarResponses responses = TheHead()->Silent();
  TheHead()->Respond(At(0), responses);
  constexpr int kCount = 200;
  for (int i = 1; i <= kCount; ++i) {
    const double level = LevelAt(responses[1].taps, 50.0 * i);
    power += std::pow(10, level / 10) / kCount;
  }
  EXPECT_NEAR(power, 1, 0.02);
}

TEST(BinauralTest, AnObjectIsLouderAndEarlierInTheNearEar) {
  for (const double degrees : {-90.0, -40.0, 0.0, 25.0, 60.0, 90.0, 150.0}) {
    const auto [left, right] = Play({.binaural = true}, At(degrees), Click(1000, 4096));
    const double sine = std::sin(degrees * kPi / 180);
    EXPECT_NEAR(PeakFrame(left) - PeakFrame(right),
                (SphereHead::DelayS(-sine) - SphereHead::DelayS(sine)) * kRate, 0.7)
        << degrees;
    const double ratio = SphereHead::GainOf(-sine) / SphereHead::GainOf(sine);
    EXPECT_NEAR(LevelAt(left, 1000) - LevelAt(right, 1000), 20 * std::log10(ratio), 0.3) << degrees;
  }
}

TEST(BinauralTest, DistanceAndPropagationAddToTheEars) {
  const HearingSettings hearing{.distance_gain = true, .propagation_delay = true, .binaural = true};
  const auto near = Play(hearing, At(0, 1), Click(1000, 16384));
  const auto far = Play(hearing, At(0, 35.3), Click(1000, 16384));
  EXPECT_NEAR(PeakFrame(far[0]) - PeakFrame(near[0]), 34.3 / 343 * kRate, 0.3);
  EXPECT_NEAR(Peak(near[0]) / Peak(far[0]), 35.3, 0.4);
}

TEST(BinauralTest, TheSizeOfBlocksMakesNoDifferenceAtRest) {
  const std::vector<float> tone = Tone(700, 0.16, 1);
  const auto a = Play({.binaural = true}, At(50), tone, {}, 64);
  const auto b = Play({.binaural = true}, At(50), tone, {}, 128);
  for (size_t n = 0; n + 64 < a[0].size(); ++n) {  // a voice is one block late
    ASSERT_NEAR(a[0][n], b[0][n], 1e-5) << n;
    ASSERT_NEAR(a[1][n], b[1][n], 1e-5) << n;
  }
}

TEST(BinauralTest, AnObjectThatCirclesDoesNotClickAndIsHeardAsIfTheListenerTurned) {
  const auto angle = [](size_t n) { return static_cast<double>(n) / 96000 * 720; };
  const std::vector<float> tone = Tone(400, 2, 1);
  const auto turned = Play({.binaural = true}, At(0), tone, [&angle](Voice& voice, size_t n) {
    if (n % 800 >= 128) return;
    // To the left, so that the object wanders to the right; half of the angle in the quaternion.
    const double half = std::remainder(angle(n), 360) / 2 * kPi / 180;
    voice.MoveListener({.right = {static_cast<float>(std::cos(2 * half)), 0,
                                  static_cast<float>(-std::sin(2 * half))},
                        .orientation = {0, static_cast<float>(std::sin(half)), 0},
                        .glide_frames = 800},
                       0);
  });
  const auto circled = Play({.binaural = true}, At(0), tone, [&angle](Voice& voice, size_t n) {
    if (n % 800 < 128) voice.Move(MotionTo(At(angle(n)), 800), 0);
  });
  for (const size_t ear : {0U, 1U}) {
    EXPECT_GT(Peak(circled[ear]), 0.5);
    EXPECT_LT(FastestPart(circled[ear]), 3e-5 * Peak(circled[ear]));  // -90 dB
    EXPECT_LT(FastestPart(turned[ear]), 3e-5 * Peak(turned[ear]));
    EXPECT_LT(LargestDifference(turned[ear], circled[ear]), 0.01 * Peak(circled[ear]));
  }
}

TEST(BinauralTest, AJumpIsACrossFadeFromTheSoundBefore) {
  const auto heard =
      Play({.binaural = true}, At(-70), Tone(400, 0.2, 1), [](Voice& voice, size_t n) {
        if (n == 4992) voice.Move(MotionTo(At(70), 0), 0);
      });
  const auto after = Play({.binaural = true}, At(70), Tone(400, 0.2, 1));
  for (const size_t ear : {0U, 1U}) {
    EXPECT_LT(FastestPart(heard[ear]), 1e-3 * Peak(heard[ear]));
    for (size_t n = 6500; n < 9500; ++n) ASSERT_NEAR(heard[ear][n], after[ear][n], 1e-4) << n;
  }
}

TEST(BinauralTest, AnObjectAtTheListenersPlaceIsHeard) {
  const auto [left, right] = Play({.binaural = true}, {}, Click(1000, 4096));
  EXPECT_GT(Peak(left), 0.3);
  EXPECT_NEAR(Peak(left), Peak(right), 0.02);
}

TEST(BinauralTest, SilenceEndsWhatIsOnItsWay) {
  const auto heard = Play({.propagation_delay = true, .binaural = true}, At(20, 30),
                          Click(100, 16384), [](Voice& voice, size_t n) {
                            if (n == 1024) voice.Silence();
                          });
  EXPECT_EQ(Peak(heard[0]), 0);
  EXPECT_EQ(Peak(heard[1]), 0);
}

TEST(BinauralTest, FallsAsleepOnceAllHasArrived) {
  Voice voice({.hearing = {.binaural = true}, .channel_count = 2, .head = TheHead()},
              {.position_m = At(20)}, {});
  voice.Wake();
  voice.input()[5] = 1;
  double energy = 0;
  std::vector<float> frames(256);
  for (int block = 0; block < 100 && !voice.asleep(); ++block) {
    std::ranges::fill(frames, 0.0F);
    voice.Render(frames);
    energy += Energy(frames);
  }
  EXPECT_TRUE(voice.asleep());
  EarResponses responses = TheHead()->Silent();
  TheHead()->Respond(At(20), responses);
  double whole = 0;
  for (const EarResponse& ear : responses) whole += Energy(ear.taps);
  EXPECT_NEAR(energy, whole, 0.02 * whole);
}

TEST(BinauralTest, OneChannelHasNoEarsAndInTwoTheyReplacePanning) {
  const std::vector<float> click = Click(1000, 4096);
  const auto heard = Play({.binaural = true}, At(90), click, {}, 128, 1);
  EXPECT_DOUBLE_EQ(Peak(heard[0]), 1);
  EXPECT_EQ(heard[0], heard[1]);
  EXPECT_EQ(Play({.panning = true, .binaural = true}, At(60), click),
            Play({.binaural = true}, At(60), click));
}

}  // namespace
}  // namespace carillon
