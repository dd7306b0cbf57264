// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/voice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace carillon {
namespace {

constexpr double kRate = 48000;
constexpr size_t kBlock = 128;
constexpr double kSpeed = 343;
constexpr double kPi = std::numbers::pi;

Motion MotionTo(double x, double y, double z, double glide_frames) {
  return {.position_m = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)},
          .glide_frames = static_cast<float>(glide_frames)};
}

struct Stereo {
  std::vector<float> left, right;
};

/// A voice that is fed a sound, with poses told as a simulator of 60 Hz does.
class Heard {
 public:
  Heard(const HearingSettings& hearing, const Place& object, size_t channel_count = 2)
      : channel_count_(channel_count),
        voice_({.hearing = hearing,
                .sample_rate_hz = kRate,
                .block_frame_count = kBlock,
                .channel_count = channel_count},
               object, {}) {}

  Voice& voice() { return voice_; }

  /// `at_block`, if any, is called before each block.
  Stereo Play(const std::vector<float>& sound,
              const std::function<void(Voice&, size_t frame)>& at_block = {}) {
    Stereo heard;
    std::vector<float> frames(kBlock * channel_count_);
    for (size_t n = 0; n + kBlock <= sound.size(); n += kBlock) {
      if (at_block) at_block(voice_, n);
      std::copy_n(sound.begin() + static_cast<ptrdiff_t>(n), kBlock, voice_.input().begin());
      std::ranges::fill(frames, 0.0F);
      voice_.Render(frames);
      for (size_t i = 0; i < kBlock; ++i) {
        heard.left.push_back(frames[i * channel_count_]);
        heard.right.push_back(frames[(i + 1) * channel_count_ - 1]);
      }
    }
    return heard;
  }

 private:
  size_t channel_count_;
  Voice voice_;
};

std::vector<float> Tone(double frequency_hz, double seconds) {
  std::vector<float> tone(static_cast<size_t>(seconds * kRate));
  for (size_t n = 0; n < tone.size(); ++n) {
    tone[n] =
        static_cast<float>(0.5 * std::sin(2 * kPi * frequency_hz * static_cast<double>(n) / kRate));
  }
  return tone;
}

std::vector<float> Click(size_t frame, size_t frame_count) {
  std::vector<float> click(frame_count);
  click[frame] = 1;
  return click;
}

double Peak(const std::vector<float>& sound) {
  return std::abs(*std::ranges::max_element(sound, {}, [](float x) { return std::abs(x); }));
}

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
    largest = std::max(largest, std::abs(sound[n + 1] + sound[n - 1] - c * sound[n]));
  }
  return largest;
}

TEST(Voice, ALevelFallsBySixDecibelsForEachDoublingAndNoNearerThanTheReference) {
  const std::vector<float> tone = Tone(1000, 0.1);
  const auto level = [&](double distance_m) {
    Heard heard({.distance_gain = true, .reference_distance_m = 0.5},
                {.position_m = {0, 0, -distance_m}}, 1);
    return Peak(heard.Play(tone).left) / Peak(tone);
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
    const std::vector<float> sound = heard.Play(Click(300, 40000)).left;
    for (size_t n = 0; n < sound.size(); ++n) {
      // Rounding of the distance leaves 1e-9 frames or so.
      EXPECT_NEAR(sound[n], n == 300 + delay ? 1 : 0, 1e-6) << n;
    }
  }
}

TEST(Voice, ADelayBetweenTwoSamplesKeepsAToneWhole) {
  for (const double frequency_hz : {100.0, 5000.0, 15000.0}) {
    Heard heard({.propagation_delay = true}, {.position_m = {0, 0, 1000.37 * kSpeed / kRate}}, 1);
    const std::vector<float> sound = heard.Play(Tone(frequency_hz, 0.5)).left;
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
    const Stereo sound = heard.Play(tone);
    const double left = Peak(sound.left) / Peak(tone), right = Peak(sound.right) / Peak(tone);
    EXPECT_NEAR(left * left + right * right, 2, 1e-6) << degrees;
    EXPECT_NEAR(std::atan2(right, left), kPi * (1 + std::sin(angle)) / 4, 1e-6) << degrees;
  }
}

TEST(Voice, AListenerWhoTurnsHearsItOnTheOtherSide) {
  Heard heard({.panning = true}, {.position_m = {0, 0, -2}});
  Motion turned = MotionTo(0, 0, 0, 4800);
  turned.right = {0, 0, -1};  // he looks along -x now
  heard.voice().MoveListener(turned, 0);
  const Stereo sound = heard.Play(Tone(1000, 0.5));
  EXPECT_NEAR(sound.left[0], sound.right[0], 1e-6);
  const std::vector<float> end_left(sound.left.end() - 2000, sound.left.end());
  EXPECT_LT(Peak(end_left), 1e-6);
}

/// Tells the voice each 800 frames, a step before, where it is to be.
auto Drive(const std::function<std::array<double, 3>(double)>& position) {
  return [position, next = size_t{0}](Voice& voice, size_t frame) mutable {
    for (; next < frame + kBlock; next += 800) {
      const auto [x, y, z] = position(static_cast<double>(next + 800) / kRate);
      voice.Move(MotionTo(x, y, z, 800), next < frame ? 0 : next - frame);
    }
  };
}

TEST(Voice, AMovingObjectChangesItsPitchByTheDopplerFactorOfAMovingSource) {
  for (const double speed : {-30.0, -10.0, 10.0, 30.0}) {
    const double start_m = speed < 0 ? 100 : 5;
    Heard heard({.propagation_delay = true}, {.position_m = {0, 0, start_m}}, 1);
    const auto sound = heard.Play(Tone(1000, 2), Drive([&](double t) -> std::array<double, 3> {
                                    return {0, 0, start_m + speed * t};
                                  }));
    const double expected_hz = 1000 * kSpeed / (kSpeed + speed);
    EXPECT_NEAR(FrequencyHz(sound.left, 48000, 96000), expected_hz, 1e-4 * expected_hz) << speed;
  }
}

TEST(Voice, AListenerWhoMovesHearsTheDopplerFactorOfAMovingReceiver) {
  Heard heard({.propagation_delay = true}, {.position_m = {0, 0, 100}}, 1);
  heard.voice().MoveListener(MotionTo(0, 0, 60, 96000), 0);  // 30 m/s nearer
  const Stereo sound = heard.Play(Tone(1000, 2));
  const double expected_hz = 1000 * (kSpeed + 30) / kSpeed;
  EXPECT_NEAR(FrequencyHz(sound.left, 48000, 95000), expected_hz, 1e-4 * expected_hz);
}

TEST(Voice, TheDopplerFactorHoldsForFastObjects) {
  for (const auto [start_m, speed, begin_s, end_s] :
       {std::array{200.0, -250.0, 0.63, 0.7}, std::array{5.0, 300.0, 0.15, 0.6}}) {
    Heard heard({.propagation_delay = true}, {.position_m = {0, 0, start_m}}, 1);
    const auto sound = heard.Play(
        Tone(1000, 0.75), Drive([z = start_m, v = speed](double t) -> std::array<double, 3> {
          return {0, 0, z + v * t};
        }));
    const double expected_hz = 1000 * kSpeed / (kSpeed + speed);
    EXPECT_NEAR(FrequencyHz(sound.left, static_cast<size_t>(begin_s * kRate),
                            static_cast<size_t>(end_s * kRate)),
                expected_hz, 2e-3 * expected_hz)
        << speed;
  }
}

TEST(Voice, TheDopplerFactorHoldsForFastListeners) {
  for (const auto [start_m, speed] : {std::array{205.0, -300.0}, std::array{5.0, 300.0}}) {
    Heard heard({.propagation_delay = true}, {}, 1);
    heard.voice().MoveListener(MotionTo(0, 0, start_m, 0), 0);
    heard.Play(std::vector<float>(48000));
    heard.voice().MoveListener(MotionTo(0, 0, start_m + 0.6 * speed, 28800), 0);
    const Stereo sound = heard.Play(Tone(1000, 0.6));
    const double expected_hz = 1000 * (kSpeed - speed) / kSpeed;
    // The tone reaches a listener who comes nearer 0.32 s after its start.
    EXPECT_NEAR(FrequencyHz(sound.left, 17280, 27840), expected_hz, 5e-3 * expected_hz) << speed;
  }
}

TEST(Voice, AnObjectThatCirclesCloselyDoesNotClick) {
  const HearingSettings all{.distance_gain = true, .propagation_delay = true, .panning = true};
  Heard heard(all, {.position_m = {1, 0, 0}});
  // Half a metre from the listener at its nearest, at 6 m/s.
  const auto position = [](double t) -> std::array<double, 3> {
    return {1.5 * std::cos(4 * t) - 0.5, 0, 1.5 * std::sin(4 * t)};
  };
  const Stereo sound = heard.Play(Tone(1000, 3), Drive(position));
  // What the shift of pitch and level by a few percent leaves of a tone of 0.7: 2 |dw| w; a jump of
  // -60 dB would be more.
  const double w = 2 * kPi * 1000 / kRate;
  const double allowed = 2 * 0.7 * w * w * (6 / kSpeed) + 2e-4;
  EXPECT_LT(LargestClick(sound.left, 1000, 9600), allowed);
  EXPECT_LT(LargestClick(sound.right, 1000, 9600), allowed);
}

TEST(Voice, AJumpIsAFade) {
  const HearingSettings all{.distance_gain = true, .propagation_delay = true, .panning = true};
  Heard heard(all, {.position_m = {1, 0, 0}});
  const auto jump = [](Voice& voice, size_t frame) {
    if (frame == 375 * kBlock) voice.Move(MotionTo(-20, 3, 1, 0), 5);
  };
  const Stereo sound = heard.Play(Tone(1000, 2), jump);
  // A fade in 480 frames bends a tone of 1.4 by no more than two of these.
  const double w = 2 * kPi * 1000 / kRate;
  EXPECT_LT(LargestClick(sound.left, 1000, 9600), 2 * 1.4 * w / 480 * 2);
  EXPECT_LT(LargestClick(sound.right, 1000, 9600), 2 * 1.4 * w / 480 * 2);
  const std::vector<float> after(sound.right.end() - 9600, sound.right.end());
  EXPECT_LT(Peak(after), 0.01);  // 20 m to the left
}

TEST(Voice, FallsAsleepWhenAllHasArrivedAndNothingMoves) {
  Heard heard({.propagation_delay = true}, {.position_m = {100, 0, 0}}, 1);
  heard.voice().Wake();
  const Stereo sound = heard.Play(Click(0, 48000));
  EXPECT_NEAR(Peak(sound.left), 1, 0.3);
  std::vector<float> frames(kBlock);
  for (int block = 0; block < 500 && !heard.voice().asleep(); ++block) {
    heard.voice().Render(frames);
  }
  EXPECT_TRUE(heard.voice().asleep());
  heard.voice().Move(MotionTo(1, 2, 3, 4800), 0);
  heard.voice().Wake();
  heard.voice().Render(frames);
  EXPECT_FALSE(heard.voice().asleep());
}

}  // namespace
}  // namespace carillon
