// SPDX-License-Identifier: Apache-2.0
#include "server/scene/recent_poses.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>

namespace carillon {
namespace {

constexpr double kStepS = 1.0 / 60, kGravity = 9.81;
constexpr RecentPoses::Ray kUpwards{.handle = 3, .direction = {0, 0, 1}};

/// The height of a body that an engine of half implicit steps lets fall from 1 m.
double HeightM(int step) { return 1 - kGravity * kStepS * kStepS * step * (step + 1) / 2; }
double SpeedMPerS(int step) { return kGravity * kStepS * step; }

class RecentPosesTest : public testing::Test {
 protected:
  void Begin(int step, bool follows = true) { poses_.Begin(step * kStepS, follows); }
  void MoveTo(double height_m, uint64_t serial = 1) {
    poses_.Move(3, serial, {.position_m = {0, 0, height_m}});
  }
  void BeginAt(int step, double height_m, uint64_t serial = 1) {
    Begin(step);
    MoveTo(height_m, serial);
  }
  std::optional<double> Approach(const RecentPoses::Ray& ray = kUpwards) const {
    return poses_.ApproachSpeed(std::span(&ray, 1));
  }

  RecentPoses poses_;
};

TEST_F(RecentPosesTest, ABodyThatIsStoppedApproachedAsFastAsTheStepWouldHaveMadeIt) {
  for (int step = 1; step <= 12; ++step) BeginAt(step, HeightM(step));
  // The engine tells the pose after the step, in which the body has stopped.
  BeginAt(13, HeightM(12));
  ASSERT_TRUE(Approach());
  EXPECT_NEAR(*Approach(), SpeedMPerS(13), 1e-9);
}

TEST_F(RecentPosesTest, PosesBeforeTheStepGiveTheSameSpeed) {
  for (int step = 1; step <= 13; ++step) BeginAt(step, HeightM(step - 1));
  EXPECT_NEAR(*Approach(), SpeedMPerS(13), 1e-9);
}

TEST_F(RecentPosesTest, WhatABlowInTheStepBeforeChangedIsNotGainedAgain) {
  for (int step = 1; step <= 12; ++step) BeginAt(step, -3 * kStepS * step);
  BeginAt(13, -3 * kStepS * 12 - 2 * kStepS);  // a blow at another place takes 1 m/s
  BeginAt(14, -3 * kStepS * 12 - 2 * kStepS);
  EXPECT_NEAR(*Approach(), 2, 1e-9);
}

TEST_F(RecentPosesTest, ThePointsOfATurningBodyDifferInSpeed) {
  constexpr double kRadPerS = 2, kArmM = 0.3;
  for (int step = 1; step <= 5; ++step) {
    Begin(step);
    const double half = kRadPerS * kStepS * step / 2;
    poses_.Move(3, 1, {.orientation = {.w = std::cos(half), .y = std::sin(half)}});
  }
  // Chords of the turn differ a little from the tangent.
  RecentPoses::Ray ray{.handle = 3, .point_m = {kArmM, 0, 0}, .direction = {0, 0, 1}};
  EXPECT_NEAR(*Approach(ray), kRadPerS * kArmM, 3e-3);
  ray.point_m = {-kArmM, 0, 0};
  EXPECT_NEAR(*Approach(ray), -kRadPerS * kArmM, 3e-3);
  ray.point_m = {0, kArmM, 0};
  EXPECT_NEAR(*Approach(ray), 0, 1e-9);
}

TEST_F(RecentPosesTest, TwoBodiesApproachByTheSumOfTheirSpeedsAndOneWithoutPosesIsAtRest) {
  for (int step = 1; step <= 5; ++step) {
    BeginAt(step, -0.1 * step);
    poses_.Move(4, 2, {.position_m = {0, 0, 0.05 * step}, .orientation = {.w = 0, .x = 1}});
  }
  // The second body lies on its back, so that its own axis z points down.
  const RecentPoses::Ray downwards{.handle = 4, .direction = {0, 0, 1}};
  const RecentPoses::Ray fixed{.handle = 9, .direction = {0, 0, -1}};
  EXPECT_NEAR(*poses_.ApproachSpeed(std::array{kUpwards, downwards}), 0.15 / kStepS, 1e-9);
  EXPECT_NEAR(*poses_.ApproachSpeed(std::array{kUpwards, fixed}), 0.1 / kStepS, 1e-9);
  EXPECT_FALSE(Approach(fixed));
}

TEST_F(RecentPosesTest, ABodyKeepsItsPoseInStepsWithoutOne) {
  for (int step = 1; step <= 5; ++step) {
    Begin(step);
    if (step != 4) MoveTo(-0.1 * step);
  }
  EXPECT_NEAR(*Approach(), 0.2 / kStepS, 1e-9);  // it leaps after it has stopped
}

TEST_F(RecentPosesTest, TheFirstStepsOfABodyAndThoseAfterAGapTellNothing) {
  BeginAt(1, 1);
  EXPECT_FALSE(Approach());
  BeginAt(2, 0.9);
  EXPECT_FALSE(Approach());
  BeginAt(3, 0.8);
  EXPECT_NEAR(*Approach(), 0.1 / kStepS, 1e-9);
  BeginAt(4, 0.7, 2);  // another object with the handle
  EXPECT_FALSE(Approach());
  for (int step = 5; step <= 8; ++step) BeginAt(step, 0, 2);
  EXPECT_TRUE(Approach());
  Begin(20, false);
  MoveTo(-1, 2);
  EXPECT_FALSE(Approach());
}

TEST_F(RecentPosesTest, StepsAtOneTimeTellNothing) {
  for (int i = 0; i < 4; ++i) BeginAt(7, -0.1 * i);
  EXPECT_FALSE(Approach());
}

}  // namespace
}  // namespace carillon
