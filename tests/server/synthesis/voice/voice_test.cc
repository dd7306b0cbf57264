// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/voice.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "tests/server/synthesis/voice/heard.h"

namespace carillon {
namespace {

constexpr double kRate = kVoiceRateHz;
constexpr double kSpeed = 343;
constexpr double kPi = std::numbers::pi;
constexpr HearingSettings kAll{.distance_gain = true, .propagation_delay = true, .panning = true};

/// Measures the frequency by the zeros that the sound crosses upwards in [begin, end).
double FrequencyHz(const std::vector<float>& sound, size_t begin, size_t end) {
  std::vector<double> crossings;
  for (size_t n = begin; n + 1 < end; ++n) {
    if (sound[n] < 0 && sound[n + 1] >= 0) {
      crossings.push_back(static_cast<double>(n) + sound[n] / (sound[n] - sound[n + 1]));
    }
  }
  return static_cast<double>(crossings.size() - 1) * kRate / (crossings.back() - crossings.front());
}

/// Away from a tone, what is left of it in the second difference of its envelope of neighbours: a
/// tone of frequency w satisfies x(n+1) + x(n-1) = 2 cos(w) x(n), and a click does not.
double LargestClick(const std::vector<float>& sound, double frequency_hz, size_t begin) {
  const double c = 2 * std::cos(2 * kPi * frequency_hz / kRate);
  double largest = 0;
  for (size_t n = begin + 1; n + 1 < sound.size(); ++n) {
    largest = Larger(largest, std::abs(sound[n + 1] + sound[n - 1] - c * sound[n]));
  }
  return largest;
}

TEST(Voice, ALevelFallsBySixDecibelsForEachDoublingAndNoNearerThanTheReference) {
  const std::vector<float> tone = Tone(1000, 0.1);
  const auto level = [&](double distance_m) {
    Heard heard({.distance_gain = true, .reference_distance_m = 0.5},
                {.position_m = {0, 0, -distance_m}}, 1);
    return Peak(heard.Play(tone)[0]) / Peak(tone);
  };
  for (const double distance_m : {0.5, 1.0, 2.0, 4.0, 64.0}) {
    EXPECT_NEAR(level(distance_m), 0.5 / distance_m, 1e-6) << distance_m;
  }
  EXPECT_EQ(level(0.1), 1);
  EXPECT_EQ(level(0), 1);
}

TEST(Voice, ARestingObjectIsHeardToTheSampleLater) {
  for (const size_t delay : {100U, 101U, 5000U, 28000U}) {
    const double distance_m = static_cast<double>(delay) * kSpeed / kRate;
    Heard heard({.propagation_delay = true}, {.position_m = {distance_m, 0, 0}}, 1);
    const std::vector<float> sound = heard.Play(Click(300, 40000))[0];
    for (size_t n = 0; n < sound.size(); ++n) {
      // Rounding of the distance leaves 1e-9 frames or so.
      EXPECT_NEAR(sound[n], n == 300 + delay ? 1 : 0, 1e-6) << n;
    }
  }
}

TEST(Voice, ADelayBetweenTwoSamplesKeepsAToneWhole) {
  for (const double frequency_hz : {100.0, 5000.0, 15000.0}) {
    Heard heard({.propagation_delay = true}, {.position_m = {0, 0, 1000.37 * kSpeed / kRate}}, 1);
    const std::vector<float> sound = heard.Play(Tone(frequency_hz, 0.5))[0];
    for (size_t n = 2000; n < sound.size(); ++n) {
      const double time_s = (static_cast<double>(n) - 1000.37) / kRate;
      // The interpolation's error is below -80 dB of the tone's 0.5.
      EXPECT_NEAR(sound[n], 0.5 * std::sin(2 * kPi * frequency_hz * time_s), 5e-5) << n;
    }
  }
}

TEST(Voice, PanningKeepsThePowerOfBothChannelsAndFollowsTheAngle) {
  const std::vector<float> tone = Tone(1000, 0.05);
  for (int degrees = -180; degrees <= 180; degrees += 15) {
    const double angle = degrees * kPi / 180;
    Heard heard({.panning = true}, {.position_m = {3 * std::sin(angle), 0, -3 * std::cos(angle)}});
    const Channels sound = heard.Play(tone);
    const double left = Peak(sound[0]) / Peak(tone), right = Peak(sound[1]) / Peak(tone);
    EXPECT_NEAR(left * left + right * right, 2, 1e-6) << degrees;
    EXPECT_NEAR(std::atan2(right, left), kPi * (1 + std::sin(angle)) / 4, 1e-6) << degrees;
  }
}

TEST(Voice, AListenerWhoTurnsHearsItOnTheOtherSide) {
  Heard heard({.panning = true}, {.position_m = {0, 0, -2}});
  Motion turned = MotionTo({0, 0, 0}, 4800);
  turned.right = {0, 0, -1};  // he looks along -x now
  heard.voice().MoveListener(turned, 0);
  const Channels sound = heard.Play(Tone(1000, 0.5));
  EXPECT_NEAR(sound[0][0], sound[1][0], 1e-6);
  EXPECT_LT(Peak(std::span(sound[0]).last(2000)), 1e-6);
}

/// Tells the voice each 800 frames, a step before, where it is to be.
auto Drive(const std::function<std::array<double, 3>(double)>& position) {
  return [position, next = size_t{0}](Voice& voice, size_t frame) mutable {
    for (; next < frame + 128; next += 800) {
      const double time_s = static_cast<double>(next + 800) / kRate;
      voice.Move(MotionTo(position(time_s), 800), next < frame ? 0 : next - frame);
    }
  };
}

TEST(Voice, AMovingObjectChangesItsPitchByTheDopplerFactorOfAMovingSource) {
  const struct {
    double start_m, speed, begin_s, end_s, tolerance;
  } moves[] = {{100, -30, 1, 2, 1e-4}, {100, -10, 1, 2, 1e-4},       {5, 10, 1, 2, 1e-4},
               {5, 30, 1, 2, 1e-4},    {200, -250, 0.63, 0.7, 2e-3}, {5, 300, 0.15, 0.6, 2e-3}};
  for (const auto& move : moves) {
    Heard heard({.propagation_delay = true}, {.position_m = {0, 0, move.start_m}}, 1);
    const auto drive = Drive([&move](double t) -> std::array<double, 3> {
      return {0, 0, move.start_m + move.speed * t};
    });
    const std::vector<float> sound = heard.Play(Tone(1000, move.end_s + 0.05), drive)[0];
    const double expected_hz = 1000 * kSpeed / (kSpeed + move.speed);
    EXPECT_NEAR(FrequencyHz(sound, static_cast<size_t>(move.begin_s * kRate),
                            static_cast<size_t>(move.end_s * kRate)),
                expected_hz, move.tolerance * expected_hz)
        << move.speed;
  }
}

TEST(Voice, AListenerWhoMovesHearsTheDopplerFactorOfAMovingReceiver) {
  const struct {
    double start_m, speed, duration_s;
    size_t begin, end;
    double tolerance;
  } moves[] = {{100, -30, 2, 48000, 95000, 1e-4},
               {205, -300, 0.6, 17280, 27840, 5e-3},  // the tone arrives 0.32 s after its start
               {5, 300, 0.6, 17280, 27840, 5e-3}};
  for (const auto& move : moves) {
    Heard heard({.propagation_delay = true}, {}, 1);
    heard.voice().MoveListener(MotionTo({0, 0, move.start_m}, 0), 0);
    heard.Play(std::vector<float>(48000));
    heard.voice().MoveListener(
        MotionTo({0, 0, move.start_m + move.duration_s * move.speed}, move.duration_s * kRate), 0);
    const std::vector<float> sound = heard.Play(Tone(1000, move.duration_s))[0];
    const double expected_hz = 1000 * (kSpeed - move.speed) / kSpeed;
    EXPECT_NEAR(FrequencyHz(sound, move.begin, move.end), expected_hz, move.tolerance * expected_hz)
        << move.speed;
  }
}

TEST(Voice, AnObjectThatCirclesCloselyDoesNotClick) {
  Heard heard(kAll, {.position_m = {1, 0, 0}});
  // Half a metre from the listener at its nearest, at 6 m/s.
  const auto position = [](double t) -> std::array<double, 3> {
    return {1.5 * std::cos(4 * t) - 0.5, 0, 1.5 * std::sin(4 * t)};
  };
  const Channels sound = heard.Play(Tone(1000, 3), Drive(position));
  // What the shift of pitch and level by a few percent leaves of a tone of 0.7: 2 |dw| w; a jump of
  // -60 dB would be more.
  const double w = 2 * kPi * 1000 / kRate;
  const double allowed = 2 * 0.7 * w * w * (6 / kSpeed) + 2e-4;
  EXPECT_LT(LargestClick(sound[0], 1000, 9600), allowed);
  EXPECT_LT(LargestClick(sound[1], 1000, 9600), allowed);
}

TEST(Voice, AJumpIsAFade) {
  Heard heard(kAll, {.position_m = {1, 0, 0}});
  const auto jump = [](Voice& voice, size_t frame) {
    if (frame == 375 * 128) voice.Move(MotionTo({-20, 3, 1}, 0), 5);
  };
  const Channels sound = heard.Play(Tone(1000, 2), jump);
  // A fade in 480 frames bends a tone of 1.4 by no more than two of these.
  const double w = 2 * kPi * 1000 / kRate;
  EXPECT_LT(LargestClick(sound[0], 1000, 9600), 2 * 1.4 * w / 480 * 2);
  EXPECT_LT(LargestClick(sound[1], 1000, 9600), 2 * 1.4 * w / 480 * 2);
  EXPECT_LT(Peak(std::span(sound[1]).last(9600)), 0.01);  // 20 m to the left
}

TEST(Voice, FallsAsleepWhenAllHasArrivedAndNothingMoves) {
  Heard heard({.propagation_delay = true}, {.position_m = {100, 0, 0}}, 1);
  heard.voice().Wake();
  const Channels sound = heard.Play(Click(0, 48000));
  EXPECT_NEAR(Peak(sound[0]), 1, 0.3);
  std::vector<float> frames(128);
  for (int block = 0; block < 500 && !heard.voice().asleep(); ++block) {
    heard.voice().Render(frames);
  }
  EXPECT_TRUE(heard.voice().asleep());
  heard.voice().Move(MotionTo({1, 2, 3}, 4800), 0);
  heard.voice().Wake();
  heard.voice().Render(frames);
  EXPECT_FALSE(heard.voice().asleep());
}

}  // namespace
}  // namespace carillon
