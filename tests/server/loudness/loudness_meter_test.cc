// SPDX-License-Identifier: Apache-2.0
#include "server/loudness/loudness_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace carillon {
namespace {

constexpr uint32_t kRateHz = 48000;

/// A sine on every channel, interleaved.
std::vector<float> Sine(double hz, double amplitude, double seconds, uint32_t channel_count,
                        double phase = 0) {
  std::vector<float> samples;
  for (int frame = 0; frame < seconds * kRateHz; ++frame) {
    const double x = amplitude * std::sin(2 * std::numbers::pi * hz * frame / kRateHz + phase);
    samples.insert(samples.end(), channel_count, static_cast<float>(x));
  }
  return samples;
}

// EBU Tech 3341, case 1: a stereo sine of 1 kHz at -23 dBFS reads -23.0 +- 0.1 LUFS on all scales.
TEST(LoudnessMeter, AStereoSineAtMinus23ReadsMinus23Lufs) {
  LoudnessMeter meter(kRateHz, 2);
  meter.Add(Sine(1000, std::pow(10, -23 / 20.0), 20, 2));
  EXPECT_NEAR(meter.momentary().value(), -23, 0.1);
  EXPECT_NEAR(meter.short_term().value(), -23, 0.1);
  EXPECT_NEAR(meter.integrated().value(), -23, 0.1);
  EXPECT_NEAR(meter.loudest_momentary().value(), -23, 0.1);
}

TEST(LoudnessMeter, OneChannelIsAsLoudAsTheSameOnBoth) {
  LoudnessMeter mono(kRateHz, 1), stereo(kRateHz, 2);
  mono.Add(Sine(500, 0.1, 1, 1));
  stereo.Add(Sine(500, 0.1, 1, 2));
  EXPECT_NEAR(mono.integrated().value(), stereo.integrated().value(), 1e-6);
}

TEST(LoudnessMeter, SilenceHasNoLoudness) {
  LoudnessMeter meter(kRateHz, 1);
  meter.Add(std::vector<float>(4 * kRateHz));
  EXPECT_FALSE(meter.momentary() || meter.short_term() || meter.integrated() ||
               meter.loudest_momentary());
  EXPECT_EQ(meter.true_peak(), 0);
}

TEST(LoudnessMeter, TheLoudestMomentStaysWhenTheSoundIsOver) {
  LoudnessMeter meter(kRateHz, 1);
  meter.Add(Sine(1000, 0.1, 1, 1));
  const double loud = meter.momentary().value();
  meter.Add(std::vector<float>(kRateHz));
  EXPECT_FALSE(meter.momentary());
  EXPECT_NEAR(meter.loudest_momentary().value(), loud, 1e-9);
}

TEST(LoudnessMeter, TheSizeOfThePiecesMakesNoDifference) {
  LoudnessMeter whole(kRateHz, 2), pieces(kRateHz, 2);
  const std::vector<float> sound = Sine(700, 0.2, 2, 2);
  whole.Add(sound);
  for (size_t at = 0; at < sound.size(); at += 254) {
    pieces.Add(std::span(sound).subspan(at, std::min<size_t>(254, sound.size() - at)));
  }
  EXPECT_EQ(pieces.integrated().value(), whole.integrated().value());
  EXPECT_EQ(pieces.loudest_momentary().value(), whole.loudest_momentary().value());
}

// A quarter of the sampling rate at 45 degrees: no sample is above 0.71, the sound itself
// reaches 1.
TEST(LoudnessMeter, TheTruePeakLiesBetweenTheSamples) {
  LoudnessMeter meter(kRateHz, 1);
  meter.Add(Sine(kRateHz / 4.0, 1, 0.5, 1, std::numbers::pi / 4));
  EXPECT_NEAR(meter.true_peak(), 1, 0.05);  // EBU Tech 3341 allows +0.2 and -0.4 dB
}

}  // namespace
}  // namespace carillon
