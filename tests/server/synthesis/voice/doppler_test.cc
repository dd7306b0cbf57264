// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/doppler.h"

#include <gtest/gtest.h>

#include <cmath>

namespace carillon {
namespace {

constexpr double kRate = 48000, kSoundSpeed = 343;
constexpr size_t kBlock = 128;
constexpr DelayLimits kLimits{.frames_per_metre = kRate / kSoundSpeed,
                              .block_frame_count = kBlock,
                              .least_frames = 12,
                              .most_frames = 0.6 * kRate};

/// Positions on the axis x of an object that moves at `speed` and is at `last_x_m` now.
PastPositions Moving(double last_x_m, double speed_m_per_s) {
  constexpr int kBlocks = 230;
  PastPositions positions(kBlocks, {});
  for (int ago = kBlocks - 1; ago >= 0; --ago) {
    positions.Add({last_x_m - speed_m_per_s * ago * kBlock / kRate, 0, 0});
  }
  return positions;
}

TEST(DopplerTest, SoundComesFromWhereTheObjectWas) {
  // At the origin, x(t - d) = x - v d = c d for an object that comes nearer or goes away.
  for (const double speed : {-100.0, -10.0, 0.0, 10.0, 100.0}) {
    const SoundPath path = FindSoundPath(Moving(50, speed), {}, kLimits, 50 * kRate / kSoundSpeed);
    const double delay_s = 50 / (kSoundSpeed + speed);
    EXPECT_NEAR(path.delay_frames / kRate, delay_s, 2e-3 * delay_s) << speed;
    EXPECT_NEAR(path.away_m[0], kSoundSpeed * delay_s, 2e-3 * 50) << speed;
  }
}

TEST(DopplerTest, FindsTheDelayOfFastObjectsFromAPoorEstimate) {
  for (const double speed : {-260.0, -200.0, 200.0, 300.0, 340.0}) {
    const double delay_s = 30 / (kSoundSpeed + speed);
    for (const double estimate : {12.0, 2 * delay_s * kRate}) {
      const SoundPath path = FindSoundPath(Moving(30, speed), {}, kLimits, estimate);
      EXPECT_NEAR(path.delay_frames, delay_s * kRate, 1e-3) << speed;
    }
  }
}

TEST(DopplerTest, TheCurveJoinsTheDelaysWithoutAKink) {
  const DelayCurve first({100, 110, 125, 130}), second({110, 125, 130, 128});
  EXPECT_DOUBLE_EQ(first.At(0), 110);
  EXPECT_DOUBLE_EQ(first.At(1), 125);
  EXPECT_DOUBLE_EQ(second.At(0), 125);
  constexpr double kStep = 1e-6;
  EXPECT_NEAR((first.At(1) - first.At(1 - kStep)) / kStep,
              (second.At(kStep) - second.At(0)) / kStep, 1e-3);
}

TEST(DopplerTest, AConstantSpeedGivesAConstantSlope) {
  // The slope is the Doppler shift: a sound is read 1 - slope times as fast.
  const DelayCurve curve({100, 90, 80, 70});
  for (const double u : {0.0, 0.3, 0.7, 1.0}) EXPECT_NEAR(curve.At(u), 90 - 10 * u, 1e-12);
}

}  // namespace
}  // namespace carillon
