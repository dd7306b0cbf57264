// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/acceleration_noise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "server/synthesis/bank/level.h"
#include "tests/server/synthesis/bank/struck_ball.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRate = 48000;
constexpr double kMassKg = kBallDensity * kBallM3;
constexpr size_t kBlock = 128;
constexpr size_t kFrames = 8 * kBlock;

/// A ball whose rotation about z moves air as a quadrupole xy, as if it had a bump.
MovedBody Ball(double size = 1) {
  MovedBody moved = MakeBall(size);
  moved.body.motions[5].strengths[4] = 0.02;
  return moved;
}

using Impulse = std::array<float, 3>;

TrianglePoint Corner(uint32_t vertex) {
  return {.vertices = {vertex, vertex, vertex}, .weights = {1, 0, 0}};
}

std::vector<float> Render(AccelerationNoise& noise) {
  std::vector<float> frames(kFrames);
  for (size_t first = 0; first < kFrames; first += kBlock) {
    noise.RenderAdd(std::span(frames).subspan(first, kBlock));
  }
  return frames;
}

struct Blow {
  uint32_t vertex = 2;
  Impulse impulse{0, 0, -0.1F};
  double duration_s = 5e-4;
  size_t offset = 0;
  float lead_frames = 0;
};

SurfaceImpulse ImpulseOf(const Blow& blow) {
  return {.at = Corner(blow.vertex),
          .impulse_newton_seconds = blow.impulse,
          .pulse = Pulse::RaisedCosine(static_cast<float>(blow.duration_s))};
}

/// The sound in pascals at 1 m.
std::vector<float> Sound(const Blow& blow, const Bearing* bearing, const MovedBody& body = Ball()) {
  AccelerationNoise noise(body, kRate, 1);
  noise.Begin(ImpulseOf(blow), blow.offset, blow.lead_frames, bearing);
  return Render(noise);
}

constexpr Bearing kFromAbove{.direction = {0, 0, 1}, .distance_m = 1};

TEST(AccelerationNoise, OfATranslatingSphereFollowsItsDifferentialEquation) {
  for (const double duration_s : {1e-4, 5e-4, 4e-3}) {
    const auto sound = Sound({.duration_s = duration_s}, &kFromAbove);
    const double amplitude = -0.1 * kBallAirDensity * kBallRadiusM * kBallRadiusM / kMassKg;
    const auto expected = IntegrateBall(kRate, kFrames, amplitude, [duration_s](double t) {
      return t < duration_s ? (1 - std::cos(2 * kPi * t / duration_s)) / duration_s : 0;
    });
    const std::vector<double> heard(sound.begin(), sound.end());
    EXPECT_LT(LargestDifference(heard, expected), 1e-3 * Peak(expected)) << duration_s;
  }
}

// A slow sphere is a dipole of its volume and half of it as added mass:
// p = rho0 a^3/(2 c) dA/dt, so that a body of twice the size and the same density is as loud.
TEST(AccelerationNoise, OfASlowBlowIsThatOfADipoleOfAnySize) {
  constexpr double kDuration = 0.01;
  const double steepest = 2 * kPi / (kDuration * kDuration);
  const double expected = 0.1 * kBallAirDensity * std::pow(kBallRadiusM, 3) /
                          (2 * kBallSoundSpeed) * steepest / kMassKg;
  for (const double size : {0.5, 1.0}) {
    const auto sound = Sound({.duration_s = kDuration}, &kFromAbove, Ball(size));
    EXPECT_NEAR(Peak(sound), expected, 0.03 * expected) << size;
  }
}

TEST(AccelerationNoise, FallsSilentBesideTheAxis) {
  const Bearing beside{.direction = {1, 0, 0}, .distance_m = 1};
  EXPECT_LT(Peak(Sound({}, &beside)), 1e-6 * Peak(Sound({}, &kFromAbove)));
}

// Gauss's rule over the directions of an octahedron is exact for squares of dipoles.
TEST(AccelerationNoise, WithoutDirectionsHasTheirMeanPower) {
  const Blow blow{.impulse = {0.3F, -0.5F, 0.8F}};
  double sum = 0;
  for (const double sign : {-1.0, 1.0}) {
    for (size_t axis = 0; axis < 3; ++axis) {
      Bearing bearing{.direction = {0, 0, 0}, .distance_m = 1};
      bearing.direction[axis] = sign;
      sum += Energy(Sound(blow, &bearing, MakeBall()));
    }
  }
  EXPECT_NEAR(Energy(Sound(blow, nullptr, MakeBall())), sum / 6, 1e-4 * sum);
}

// The impulse acts along y at x = 0.05 m: about z. Seen along y = x, where the quadrupole is
// strongest, it has a second difference in place of a first one; beside the body's centre none.
TEST(AccelerationNoise, OfABlowBesideTheCentreHasTheRotationToo) {
  const double half = std::sqrt(0.5);
  const Bearing diagonal{.direction = {half, half, 0}, .distance_m = 1};
  const Bearing other{.direction = {-half, half, 0}, .distance_m = 1};
  const Blow through{.vertex = 1, .impulse = {0, 1, 0}}, beside{.vertex = 0, .impulse = {0, 1, 0}};
  EXPECT_LT(LargestDifference(Sound(through, &diagonal), Sound(through, &other)), 1e-9);
  // The quadrupole has the other sign on the other diagonal: half the difference is its sound.
  EXPECT_GT(LargestDifference(Sound(beside, &diagonal), Sound(beside, &other)),
            0.1 * Peak(Sound(beside, &diagonal)));
}

TEST(AccelerationNoise, DoesNotDependOnWhereInABlockOrAFrameItBegins) {
  const auto sound = Sound({}, nullptr), later = Sound({.offset = 120}, nullptr);
  const std::vector<float> head(sound.begin(), sound.end() - 120);
  const std::vector<float> tail(later.begin() + 120, later.end());
  EXPECT_LT(LargestDifference(head, tail), 1e-6 * Peak(sound));
  // With 1 frame of lead the sound is that of a blow one frame earlier.
  const auto early = Sound({.offset = 9}, nullptr);
  const auto lead = Sound({.offset = 10, .lead_frames = 1}, nullptr);
  EXPECT_LT(LargestDifference(early, lead), 1e-6 * Peak(early));
}

TEST(AccelerationNoise, OfManyBlowsAtOnceIsTheSumOfTheirs) {
  constexpr size_t kBlows = 8 * AccelerationNoise::kMostPulses;
  for (const double spread : {0.0, 0.2}) {
    AccelerationNoise noise(Ball(), kRate, 1);
    std::vector<float> sum(kFrames);
    for (size_t i = 0; i < kBlows; ++i) {
      const double share = spread * static_cast<double>(i * 37 % kBlows) / kBlows;
      const Blow blow{.impulse = {0, 0, -1e-4F},
                      .duration_s = 5e-4 * (1 + share),
                      .offset = static_cast<size_t>(20 * share)};
      noise.Begin(ImpulseOf(blow), blow.offset, blow.lead_frames, nullptr);
      const std::vector<float> alone = Sound(blow, nullptr);
      for (size_t n = 0; n < kFrames; ++n) sum[n] += alone[n];
    }
    // A pulse lasts as long as another one of the sixteen, which differs by a sixteenth of their
    // spread if their durations are spread evenly, and by the whole spread at the worst.
    EXPECT_LT(LargestDifference(Render(noise), sum), (1e-5 + spread / 4) * Peak(sum)) << spread;
  }
}

TEST(AccelerationNoise, BoundsHowLongAPulseLasts) {
  const AccelerationNoise noise(Ball(), kRate, 1);
  EXPECT_EQ(noise.PulseFrames(Pulse()), 2);
  EXPECT_NEAR(noise.PulseFrames(Pulse::RaisedCosine(0.001F)), 48, 1e-3);
  EXPECT_NEAR(noise.PulseFrames(Pulse::Gaussian(0.001F)), 48 * std::sqrt(0.0625 / 0.0326726), 1e-3);
  EXPECT_EQ(noise.PulseFrames(Pulse::RaisedCosine(1e9F)), 7200);
  EXPECT_EQ(noise.PulseFrames(Pulse::RaisedCosine(NAN)), 2);
}

TEST(AccelerationNoise, HasNoEnergyAtFrequencyZero) {
  double sum = 0;
  const auto sound = Sound({.duration_s = 2e-4}, nullptr);
  for (const float sample : sound) sum += sample;
  EXPECT_LT(std::abs(sum), 1e-3 * Peak(sound));
}

TEST(AccelerationNoise, EndsAndBeginsAnew) {
  AccelerationNoise noise(Ball(), kRate, 1);
  for (int i = 0; i < 2; ++i) {
    EXPECT_FALSE(noise.active());
    noise.Begin(ImpulseOf({.impulse = {0, 0, -1}}), 3, 0, nullptr);
    EXPECT_TRUE(noise.active());
    EXPECT_GT(Peak(Render(noise)), 0.1);
  }
}

TEST(AccelerationNoise, IsBoundedHoweverHardAndOftenItIsStruck) {
  AccelerationNoise noise(Ball(), kRate, 1);
  for (size_t i = 0; i < 3 * AccelerationNoise::kMostPulses; ++i) {
    noise.Begin(ImpulseOf({.impulse = {0, 0, 1e6F}, .duration_s = 0}), i, 0, nullptr);
  }
  EXPECT_LE(Peak(Render(noise)), kMostAmplitude);
  EXPECT_FALSE(noise.active());
  noise.Begin(ImpulseOf({.impulse = {0, 0, NAN}, .duration_s = 0}), 0, 0, nullptr);
  EXPECT_FALSE(noise.active());
}

}  // namespace
}  // namespace carillon
