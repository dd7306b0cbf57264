// SPDX-License-Identifier: Apache-2.0
// Contacts that take time: what they leave ringing is the convolution with their pulse.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "server/synthesis/bank/oscillator_bank.h"
#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;

/// The sound of a mode at `time_s`, after a contact whose middle lies at zero, by Simpson's rule in
/// double precision, of samples of the pulse so close that a period has a hundred of them.
double Convolved(const SoundingMode& mode, double duration_s, double time_s) {
  const int count = 2 * std::max(2000, static_cast<int>(10 * duration_s * mode.damped_rad_per_s));
  double sum = 0;
  for (int i = 0; i <= count; ++i) {
    const double at_s = duration_s * (static_cast<double>(i) / count - 0.5);
    const double weight = i == 0 || i == count ? 1 : i % 2 == 1 ? 4 : 2;
    const double pulse = (1 + std::cos(2 * kPi * at_s / duration_s)) / duration_s;
    sum += weight * pulse * ClosedForm(mode, 1, time_s - at_s);
  }
  return sum * duration_s / count / 3;
}

/// The amplitude with which the mode rings `time_s` after an impulse in an instant.
double Amplitude(const SoundingMode& mode, double time_s) {
  return kSamplesPerVolumeVelocity * mode.coupling / mode.damped_rad_per_s *
         std::exp(mode.decay_rate_per_s * time_s);
}

std::vector<float> Struck(const SoundingMode& mode, Pulse pulse, size_t count, size_t offset) {
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.pulse = pulse;
  OscillatorBank bank({.modes = {mode}}, MakeUniformShapes(1), {.silence = 0});
  return Ring(bank, impulse, count, offset, 0.25F);
}

TEST_P(OnEveryTarget, ARaisedCosineIsTheConvolutionAtEveryFrequencyDecayAndDuration) {
  for (const double frequency_hz : {25.0, 180.0, 1000.0, 4000.0, 19000.0}) {
    // At 1/T the factor is 0/0 and its value 1/2.
    for (const double duration_s : {1e-7, 2e-5, 9e-5, 1 / frequency_hz, 4.1e-4, 4e-3, 0.1}) {
      for (const double decay : {1e-3, 30.0, 0.3 / duration_s, 3.9 / duration_s}) {
        if (decay > 3000 || duration_s > 0.1 || decay > 2 * kPi * frequency_hz) continue;
        const SoundingMode mode = MakeMode(0, frequency_hz, -decay, 5);
        const auto over = static_cast<size_t>(duration_s / 2 / kTestFrameS) + 2;
        const auto sound =
            Struck(mode, Pulse::RaisedCosine(static_cast<float>(duration_s)), over + 500, 100);
        for (size_t n = 100 + over; n < sound.size() && n < 100 + over + 100; n += 7) {
          const double time_s = (static_cast<double>(n) - 99.75) * kTestFrameS;
          // -94 dB of what the mode would ring with if it were struck in an instant.
          EXPECT_NEAR(sound[n], Convolved(mode, duration_s, time_s),
                      2e-5 * Amplitude(mode, time_s) + 1e-12)
              << frequency_hz << " Hz, " << duration_s << " s, " << decay << " 1/s";
        }
      }
    }
  }
}

TEST_P(OnEveryTarget, AboveItsBandARaisedCosineFallsAsAPower) {
  const SoundingMode mode = MakeMode(0, 10000, -0.1, 5);
  for (const double periods : {5.5, 20.5, 100.5}) {
    const double duration_s = periods / 10000, y = kPi * periods;
    const auto over = static_cast<size_t>(duration_s / 2 / kTestFrameS) + 2;
    const auto sound =
        Struck(mode, Pulse::RaisedCosine(static_cast<float>(duration_s)), over + 2000, 0);
    const double peak = Peak(std::span(sound).subspan(over));
    const double right = Amplitude(mode, 0) / (y * (y * y / (kPi * kPi) - 1));
    EXPECT_NEAR(peak / right, 1, 0.01) << periods;
  }
}

TEST_P(OnEveryTarget, AModeThatDecaysWithinItsContactIsNeverMadeMuchLouder) {
  for (const double frequency_hz : {30.0, 300.0, 3000.0, 15000.0}) {
    for (const double decay : {200.0, 1000.0, 3400.0}) {
      const SoundingMode mode = MakeMode(0, frequency_hz, -decay, 5);
      for (const float duration_s : {1e-3F, 1e-2F, 0.1F}) {
        for (const Pulse pulse : {Pulse::RaisedCosine(duration_s), Pulse::Gaussian(duration_s)}) {
          EXPECT_LT(Peak(Struck(mode, pulse, 512, 0)), 1.5 * Amplitude(mode, 0));
        }
      }
    }
  }
}

TEST_P(OnEveryTarget, OfAContactOfNoLengthAndOfTheShortestOneSoundAlike) {
  const SoundingMode mode = MakeMode(0, 15000, -40, 5);
  const auto right = Struck(mode, {}, 1024, 3);
  for (const Pulse pulse : {Pulse::RaisedCosine(1e-9F), Pulse::RaisedCosine(1e-30F),
                            Pulse::Gaussian(1e-9F), Pulse::Gaussian(1e-30F)}) {
    EXPECT_LT(LargestDifference(Struck(mode, pulse, 1024, 3), right), 1e-5 * Amplitude(mode, 0));
  }
}

TEST(Pulse, OfBothShapesHaveTheVarianceOfTheirShape) {
  double cosine = 0, weight = 0;
  for (int i = -1000; i <= 1000; ++i) {
    const double t = i / 2000.0, w = 1 + std::cos(2 * kPi * t);
    cosine += w * t * t;
    weight += w;
  }
  EXPECT_NEAR(Pulse::RaisedCosine(2).variance_s2(), 4 * cosine / weight, 1e-5);
  EXPECT_FLOAT_EQ(Pulse::Gaussian(2).variance_s2(), 0.25F);
  for (const Pulse pulse : {Pulse::RaisedCosine(0.003F), Pulse::Gaussian(0.003F)}) {
    const Pulse again = Pulse::OfVariance(pulse.variance_s2(), pulse);
    EXPECT_EQ(again.gaussian(), pulse.gaussian());
    EXPECT_FLOAT_EQ(again.duration_s(), pulse.duration_s());
  }
  EXPECT_EQ(Pulse::OfVariance(0, {}), Pulse());
}

/// Merged impulses sound as one whose pulse has their mean variance.
TEST(Pulse, OfMergedImpulsesAreTheirMean) {
  const SoundingModes sounding{.modes = {MakeMode(0, 700, -20, 5), MakeMode(1, 3000, -50, 5)}};
  MixerEvent events[2];
  const float durations_s[] = {1e-4F, 3e-4F};
  std::vector<DueEvent> due;
  for (size_t i = 0; i < 2; ++i) {
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.pulse = Pulse::RaisedCosine(durations_s[i]);
    events[i].action = impulse;
    due.push_back({.offset = 8, .merged = true, .event = &events[i]});
  }
  OscillatorBank bank(sounding, MakeUniformShapes(2), {});
  const auto sound =
      RenderBlocks(bank, 1, [&](size_t, BlockMix& mix) { bank.StrikeMerged(due, mix); });
  SurfaceImpulse mean = MakeUnitImpulse();
  mean.impulse_newton_seconds[0] = 2;
  mean.pulse = Pulse::RaisedCosine(std::sqrt(5e-8F));
  OscillatorBank other(sounding, MakeUniformShapes(2), {});
  EXPECT_LT(LargestDifference(sound, Ring(other, mean, 128, 8)), 1e-8);
}

}  // namespace
}  // namespace carillon
