// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/pose_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client_sdk/motion/find_contacts.h"
#include "tests/client_sdk/motion/fall_truth.h"

namespace carillon::motion {
namespace {

/// Adds white noise to the places of a motion, and to its turns so much that a point `radius_m`
/// from the origin has as much again.
Motion Noisy(Motion motion, double noise_m, double radius_m) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, noise_m);
  const auto draw = [&] { return Vector(normal(random), normal(random), normal(random)); };
  for (MovingBody& body : motion.bodies) {
    if (body.poses.size() == 1) continue;
    for (BodyPose& pose : body.poses) {
      pose.position_m += draw();
      const Vector turn = draw() / radius_m;
      pose.orientation = Turn(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * pose.orientation;
      pose.orientation.normalize();
    }
  }
  return motion;
}

TEST(MeasureNoise, FindsNoneInWhatAnEngineComputed) {
  for (const falls::FallScene& scene : {CornerScene(), BounceScene(), AirScene(), BlocksScene()}) {
    for (const int rate : {24, 30, 60, 120, 240}) {
      const Fall fall = Drop(scene, falls::FallInBullet, 2400 / rate);
      const PoseNoise noise = MeasureNoise(fall.motion);
      EXPECT_EQ(noise.frames_apart, 1U) << rate;
      EXPECT_TRUE(noise.suffices) << rate;
      EXPECT_LT(noise.place_m, 1e-5) << rate;
    }
  }
}

TEST(MeasureNoise, MeasuresWhatWasAdded) {
  for (const int rate : {60, 120, 240}) {
    for (const double noise_m : {2e-5, 1e-4}) {
      const Fall fall = Drop(CornerScene(), falls::FallInBullet, 2400 / rate);
      // A corner of the box, whose sides are 12, 9 and 6 cm, has this distance from its centre.
      const double radius_m = 0.0807775;
      const PoseNoise noise = MeasureNoise(Noisy(fall.motion, noise_m, radius_m));
      EXPECT_NEAR(noise.place_m, std::sqrt(2) * noise_m, 0.3 * std::sqrt(2) * noise_m) << rate;
    }
  }
}

TEST(MeasureNoise, LeavesMalformedPosesToFindContacts) {
  Fall fall = Drop(CornerScene(), falls::FallInBullet, 20);
  for (BodyPose& pose : fall.motion.bodies[1].poses) pose.position_m.x() = std::nan("");
  EXPECT_EQ(MeasureNoise(fall.motion).frames_apart, 1U);
}

TEST(MeasureNoise, SaysWhereTwentyFramesASecondDoNotSuffice) {
  const Fall fall = Drop(CornerScene(), falls::FallInBullet, 20);
  const PoseNoise noise = MeasureNoise(Noisy(fall.motion, 5e-4, 0.06));
  EXPECT_FALSE(noise.suffices);
  EXPECT_EQ(noise.frames_apart, 6U);
}

TEST(TakeEach, LeavesFewFalseImpactsOfNoisyPoses) {
  for (const falls::FallScene& scene : {CornerScene(), BounceScene(), AirScene()}) {
    for (const int rate : {120, 240}) {
      Fall fall = Drop(scene, falls::FallInBullet, 2400 / rate);
      fall.motion = Noisy(fall.motion, 1e-4, 0.06);
      const Likeness before = Compare(fall, *FindContacts(fall.motion, true));
      const PoseNoise noise = MeasureNoise(fall.motion);
      TakeEach(noise.frames_apart, fall.motion);
      const FoundContacts found = FindContacts(fall.motion).value();
      const Likeness after = Compare(fall, found);
      EXPECT_GE(after.found_share, 0.9) << rate;
      EXPECT_LT(after.false_share, 0.1) << rate;
      EXPECT_LE(after.false_share, before.false_share) << rate;
      EXPECT_LT(found.confidence.unexplained, 0.01) << rate;
    }
  }
}

}  // namespace
}  // namespace carillon::motion
