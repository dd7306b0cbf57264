// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/find_contacts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>

#include "client_sdk/motion/contact_steps.h"
#include "client_sdk/motion/free_fall.h"
#include "client_sdk/motion/free_turn.h"
#include "client_sdk/motion/pose_noise.h"
#include "tests/client_sdk/motion/fall_truth.h"

namespace carillon::motion {
namespace {

using ::testing::HasSubstr;

constexpr double kGravity = 9.81;

/// The floor, and a body that has a pose in each frame.
Motion OnFloor(const falls::Body& body, double frame_s) {
  MovingBody floor = ToMoving(FloorBody());
  floor.poses.emplace_back();
  Motion motion;
  motion.frame_s = frame_s;
  motion.bodies = {floor, ToMoving(body)};
  return motion;
}

/// A body that begins to fall at a time, lands after `fall_s`, and bounces off the floor once,
/// without an engine. `rest_m`: how high its centre is when it touches the floor.
struct Bounce {
  Motion motion;
  double time_s = 0, speed_m_per_s = 0;
};
Bounce OneBounce(const falls::Body& body, double rest_m, double restitution, double frame_s,
                 double first_s, double fall_s) {
  Bounce bounce{.motion = OnFloor(body, frame_s),
                .time_s = first_s + fall_s,
                .speed_m_per_s = kGravity * fall_s};
  const double end_s = bounce.time_s + 1.75 * restitution * fall_s;  // in the air
  for (double t = 0; t < end_s; t += frame_s) {
    const double before = t - first_s, after = t - bounce.time_s;
    const double height =
        after < 0 ? kGravity * (fall_s * fall_s - before * before) / 2
                  : restitution * bounce.speed_m_per_s * after - kGravity * after * after / 2;
    bounce.motion.bodies[1].poses.push_back({{0, 0, rest_m + height}, Turn::Identity()});
  }
  return bounce;
}

/// A ball that falls 0.5 m.
Bounce BallBounce(double frame_s, double first_s) {
  return OneBounce(BallBody("ball", 0.03, 0.1), 0.03, 0.7, frame_s, first_s,
                   std::sqrt(2 * 0.5 / kGravity));
}

TEST(FindContacts, TimesOneBounceWhereverItLiesInItsFrame) {
  for (const double frame_s : {1 / 23.976, 1 / 24.0, 1 / 60.0, 1 / 120.0}) {
    for (const double first_s : {0.0, 0.003, 0.0101, 0.0173, 0.0256}) {
      const Bounce bounce = BallBounce(frame_s, first_s);
      const double impulse = 0.1 * 1.7 * bounce.speed_m_per_s;
      const FoundContacts found = FindContacts(bounce.motion).value();
      const std::vector<PairBlow> blows = Clustered(bounce.motion, found);
      ASSERT_EQ(blows.size(), 1U) << frame_s << " " << first_s;
      // Nineteen of these bounces are within 0.04 ms and 0.1 %. One lies between two of the ten
      // times at which a frame is searched, of which only one is taken.
      EXPECT_NEAR(blows[0].time_s, bounce.time_s, 0.003 * frame_s);
      EXPECT_NEAR(blows[0].impulse.z(), impulse, 3e-3 * impulse);
      for (const FoundBlow& blow : found.blows) {
        EXPECT_NEAR(blow.approach_m_per_s, bounce.speed_m_per_s, 0.01 * bounce.speed_m_per_s)
            << frame_s << " " << first_s;
      }
      EXPECT_LT(found.confidence.unexplained, 3e-4);
    }
  }
}

TEST(FindContacts, TimesAFlatLandingWhereverItLiesInItsFrame) {
  for (const double frame_s : {1 / 30.0, 1 / 60.0, 1 / 120.0}) {
    for (const double share : {0.0, 0.1, 0.3, 0.41, 0.5, 0.62, 0.7, 0.82, 0.9, 0.97}) {
      const double fall_s = frame_s * (std::round(0.2 / frame_s) + share);
      const falls::Body plate = BoxBody("plate", {0.2, 0.15, 0.01}, 2);
      const FoundContacts found =
          FindContacts(OneBounce(plate, 0.005, 0.5, frame_s, 0, fall_s).motion).value();
      double impulse = 0;
      for (const FoundBlow& blow : found.blows) {
        impulse -= blow.impulse_newton_seconds.z();
        EXPECT_NEAR(blow.impulse_newton_seconds.norm(), 0.25 * 2 * 1.5 * kGravity * fall_s, 3e-2);
        EXPECT_NEAR(static_cast<double>(blow.frame) * frame_s + blow.time_s, fall_s,
                    0.006 * frame_s)
            << frame_s << " " << share;
      }
      EXPECT_EQ(found.blows.size(), 4U) << frame_s << " " << share;
      EXPECT_NEAR(impulse, 2 * 1.5 * kGravity * fall_s, 6e-2) << frame_s << " " << share;
      EXPECT_LT(found.confidence.unexplained, 3e-4) << frame_s << " " << share;
    }
  }
}

/// A disc of 12 cm by 5 mm.
BodySurface DiscSurface() {
  constexpr uint32_t kCorners = 40;
  BodySurface disc;
  for (uint32_t i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    for (const double z : {-0.0025, 0.0025}) {
      disc.vertices_m.emplace_back(0.06 * std::cos(angle), 0.06 * std::sin(angle), z);
    }
    const uint32_t here = 2 * i, next = 2 * ((i + 1) % kCorners);
    disc.triangles.push_back({here, next, next + 1});
    disc.triangles.push_back({here, next + 1, here + 1});
    if (i > 1) {
      disc.triangles.push_back({0, here, here - 2});
      disc.triangles.push_back({1, here - 1, here + 1});
    }
  }
  return disc;
}

// A disc lands on its rim after 0.173 s and, within one frame in which it falls by more than the
// table is thick, three times from 0.392 s on. The poses are exact flights between bounces whose
// restitution is 0.5 and whose friction is 0.4.
TEST(FindContacts, TheFarSideOfAThinTableDoesNotPullADiscDown) {
  constexpr double kPoses[][3] = {
      {0, 0.205555, 1.095448},         {0.003333, 0.200105, 1.145074},
      {0.006667, 0.183755, 1.194700},  {0.010000, 0.156505, 1.244326},
      {0.013333, 0.118355, 1.293952},  {0.016667, 0.069305, 1.343579},
      {0.010264, 0.077515, 1.234043},  {0.001674, 0.090145, 1.088731},
      {-0.006917, 0.091875, 0.943419}, {-0.015508, 0.082706, 0.798107},
      {-0.024099, 0.062636, 0.652795}, {-0.032690, 0.031666, 0.507483},
      {-0.039422, 0.006557, 0.028030}};  // x, z, m, and the turn about y, rad
  const falls::Body table = BoxBody("table", {0.3, 0.2, 0.02}, 1);
  Motion motion = OnFloor(table, 1.0 / 30);
  motion.bodies[0].surface = motion.bodies[1].surface;
  motion.bodies[0].poses[0].position_m.z() = -0.01;
  MovingBody& disc = motion.bodies[1];
  disc.surface = DiscSurface();
  disc.mass_kg = 0.140791;
  disc.inertia_kg_m2 = Vector(1.26485e-4, 1.26485e-4, 2.52384e-4).asDiagonal();
  for (const auto& [x, z, turn] : kPoses) {
    disc.poses.push_back({{x, 0, z}, Turn(Eigen::AngleAxisd(turn, Vector::UnitY()))});
  }
  const FoundContacts found = FindContacts(motion).value();
  EXPECT_GE(found.blows.size(), 2U);
  for (const FoundBlow& blow : found.blows) {
    EXPECT_LT(blow.impulse_newton_seconds.z(), 0) << blow.frame;  // on the table
  }
}

TEST(FindContacts, SaysHowDeepBodiesThatStrikeAreInsideOfEachOther) {
  Bounce bounce = BallBounce(1.0 / 60, 0.003);
  const FoundContacts good = FindContacts(bounce.motion).value();
  EXPECT_LT(good.confidence.deepest_part, 0.01);
  for (MovingBody& body : bounce.motion.bodies) {
    if (body.mass_kg == 0) body.poses.front().position_m.z() += 0.05;
  }
  const FoundContacts deep = FindContacts(bounce.motion, true).value();
  ASSERT_FALSE(deep.blows.empty());
  EXPECT_GT(deep.confidence.deepest_part, 0.1);
  EXPECT_LT(deep.confidence.deepest_m, 0.051);
}

// Rods of steel, 16 cm by 14 by 10 mm, and 18 cm by 7 by 7 mm.
TEST(ShootMomentum, FindsTheTurnOfASlenderBody) {
  const Turn from(Eigen::AngleAxisd(1.1, Vector(1, 2, -1).normalized()));
  for (const Vector& moments :
       {Vector(4.337e-6, 3.766e-4, 3.780e-4), Vector(5.65e-7, 1.872e-4, 1.872e-4)}) {
    const Inertia rod(moments.asDiagonal());
    for (const Vector& speed :
         {Vector(2, 8, 0), Vector(13, 12, -5), Vector(13, 21, -5.6), Vector(30, 12, 0)}) {
      const double time_s = 1.0 / 30;
      const Vector momentum = from * moments.cwiseProduct(speed);
      const Turn to = TurnFreely(rod, from, momentum, time_s);
      const Vector turn = RotationVector(to * from.conjugate());
      const Vector guess = from * (rod.tensor_kg_m2 * (from.conjugate() * turn)) / time_s;
      const Vector found = ShootMomentum(rod, from, to, time_s, {}, guess);
      EXPECT_LT((found - momentum).norm(), 1e-5 * momentum.norm()) << moments << "\n" << speed;
    }
  }
}

/// Expects that a motion of an engine is not taken for one in another unit of length, by the limits
/// of `carillon foley`.
void ExpectOneUnit(const Motion& motion, const FoundContacts& found) {
  EXPECT_EQ(FindLengthMistake(motion).factor, 1);
  EXPECT_LT(found.confidence.sunk_part, 0.1);
  EXPECT_LT(found.confidence.apart_part, 0.5);
}

TEST(FindContacts, FindsBouncesInBulletAtAnyFrameRate) {
  for (const int rate : {24, 30, 60, 120, 240}) {
    const Fall fall = Drop(BounceScene(), falls::FallInBullet, 2400 / rate);
    const FoundContacts found = FindContacts(fall.motion).value();
    const Likeness is = Compare(fall, found);
    // At 24 and 30 frames a second, up to three bounces are within one frame.
    EXPECT_EQ(is.found_count, is.true_count) << rate;
    EXPECT_LE(is.false_share, 0.03) << rate;
    EXPECT_LT(is.median_dt_s, 1e-4) << rate;
    EXPECT_LT(is.median_vector_error, 0.01) << rate;
    EXPECT_LT(is.median_point_m, 0.001) << rate;
    ExpectOneUnit(fall.motion, found);
  }
}

/// A body that begins to fall before the first frame, and hops on the floor without tipping until
/// it rests, without an engine. It slides at a speed until friction stops it.
struct Hopping {
  double height_m = 0, restitution = 0, slides_m_per_s = 0;
};
Fall Hops(const falls::Body& body, double rest_m, Hopping hopping, double frame_s,
          double before_s) {
  constexpr double kFriction = 0.3, kLeastSpeed = 0.004, kTogetherS = 0.008;
  constexpr int kRestFrames = 12;
  Fall fall{.motion = OnFloor(body, frame_s), .blows = {}};
  const double mass = body.mass_kg;
  double time_s = -before_s, height_m = hopping.height_m, up = 0, x = 0;
  double along = hopping.slides_m_per_s, frame_time_s = 0;
  for (int frames_at_rest = 0; frames_at_rest < kRestFrames;) {
    const bool rests = height_m == 0 && up == 0;
    const double lands_s = time_s + (up + std::sqrt(up * up + 2 * kGravity * height_m)) / kGravity;
    for (; rests ? frames_at_rest < kRestFrames : frame_time_s <= lands_s;
         frame_time_s += frame_s) {
      const double since_s = frame_time_s - time_s;
      const double z = rests ? 0 : height_m + up * since_s - kGravity * since_s * since_s / 2;
      fall.motion.bodies[1].poses.push_back(
          {{x + along * since_s, 0, rest_m + z}, Turn::Identity()});
      if (rests) ++frames_at_rest;
    }
    if (rests) break;
    const double speed = kGravity * (lands_s - time_s) - up;
    x += along * (lands_s - time_s);
    const double pressed = mass * (1 + hopping.restitution) * speed;
    const double rubbed = std::min(kFriction * pressed, mass * along);
    if (fall.blows.empty() || lands_s - time_s > kTogetherS) {
      fall.blows.push_back({.a = 1, .b = 0, .time_s = lands_s, .impulse = {-rubbed, 0, pressed}});
    }
    along -= rubbed / mass;
    up = speed < kLeastSpeed ? 0 : hopping.restitution * speed;
    time_s = lands_s;
    height_m = 0;
  }
  return fall;
}

/// The mean of what is found from hops that begin at several heights.
struct FoundHops {
  double share = 0, false_share = 0, dt90_s = 0, vector_error = 0;
  double well_struck = 0;  ///< the share of the hops whose speeds are known to 5 %
};
FoundHops FindHopsOf(const falls::Body& body, double rest_m, double restitution,
                     double slides_m_per_s, int rate) {
  constexpr double kCases[][2] = {{0.1, 0.2}, {0.1, 0.4}, {0.3, 0.4}, {1, 0}};
  constexpr double kCount = std::size(kCases);
  FoundHops mean;
  for (const auto& [height_m, part] : kCases) {
    const Fall fall =
        Hops(body, rest_m, {height_m, restitution, slides_m_per_s}, 1.0 / rate, part / rate);
    const FoundContacts found = FindContacts(fall.motion).value();
    const Likeness is = Compare(fall, found);
    mean.share += is.found_share / kCount;
    mean.false_share += is.false_share / kCount;
    mean.dt90_s += is.dt90_s / kCount;
    mean.vector_error += is.median_vector_error / kCount;
    for (const PairBlow& hop : fall.blows) {
      const double speed = hop.impulse.z() / (body.mass_kg * (1 + restitution));
      const auto is_it = [&](const FoundBlow& blow) {
        return std::abs(blow.SinceFirst(fall.motion.frame_s) - hop.time_s) < 2e-3 &&
               std::abs(blow.approach_m_per_s - speed) < 0.05 * speed;
      };
      if (!std::ranges::any_of(found.blows, is_it)) continue;
      mean.well_struck += 1 / (kCount * static_cast<double>(fall.blows.size()));
    }
  }
  return mean;
}

TEST(FindContacts, FindsHopsThatAreFasterThanTheFrames) {
  const falls::Body ball = BallBody("ball", 0.03, 0.1);
  const falls::Body box = BoxBody("box", {0.12, 0.09, 0.06}, 0.45);
  for (const int rate : {24, 30, 60}) {
    for (const double restitution : {0.3, 0.5, 0.7, 0.9}) {
      // With 0.9, up to six hops lie between two frames.
      const bool many = restitution > 0.8;
      if (many && rate > 24) continue;
      for (const bool slides : {false, true}) {
        const FoundHops hops =
            FindHopsOf(slides ? box : ball, 0.03, restitution, slides ? 2 : 0, rate);
        EXPECT_GE(hops.share, many ? 0.93 : 0.99) << rate << " " << restitution << " " << slides;
        EXPECT_LE(hops.false_share, 0.04) << rate << " " << restitution << " " << slides;
        EXPECT_LT(hops.dt90_s, many ? 6e-3 : 2e-3) << rate << " " << restitution << " " << slides;
        EXPECT_LT(hops.vector_error, 0.06) << rate << " " << restitution << " " << slides;
        EXPECT_GE(hops.well_struck, many ? 0.5 : 0.8)
            << rate << " " << restitution << " " << slides;
      }
    }
  }
}

TEST(FindContacts, TakesALandingWithoutAHopForOneBlow) {
  for (const int rate : {24, 60}) {
    const Fall fall = Hops(BallBody("ball", 0.03, 0.1), 0.03, {0.3, 0, 0}, 1.0 / rate, 0.01);
    const std::vector<PairBlow> blows = Clustered(fall.motion, FindContacts(fall.motion).value());
    ASSERT_EQ(fall.blows.size(), 1U);
    ASSERT_EQ(blows.size(), 1U) << rate;
    EXPECT_NEAR(blows[0].impulse.z(), fall.blows[0].impulse.z(), 0.1 * fall.blows[0].impulse.z());
  }
}

TEST(FindContacts, DoesNotTakeARodThatClattersForOneThatHops) {
  // Its ends strike in turn, and then it lies with both of them on the floor.
  for (const int rate : {24, 60, 120}) {
    falls::Body rod = BoxBody("rod", {0.6, 0.03, 0.03}, 0.6);
    rod.position_m = {0, 0, 0.35};
    rod.orientation = {std::cos(0.2), 0, std::sin(0.2), 0};
    const Fall fall =
        Drop({.friction = 0.4, .restitution = 0.5, .seconds = 1.2, .bodies = {FloorBody(), rod}},
             falls::FallInBullet, 2400 / rate);
    const Likeness is = Compare(fall, FindContacts(fall.motion).value());
    EXPECT_GE(is.found_share, rate == 24 ? 0.7 : 0.95) << rate;
    EXPECT_LE(is.false_share, 0.05) << rate;
  }
}

/// The share of the energy of a body's linear momentum that its blows and loads leave unexplained.
double LinearlyUnexplained(const Motion& motion, uint32_t body, const FoundContacts& found) {
  const MovingBody& moves = motion.bodies[body];
  std::vector<Vector> lacks(motion.frame_count(), Vector::Zero());
  double given = 0;
  for (size_t k = 1; k + 1 < lacks.size(); ++k) {
    const Vector jump = moves.poses[k + 1].position_m - 2 * moves.poses[k].position_m +
                        moves.poses[k - 1].position_m;
    lacks[k] = moves.mass_kg * (jump / motion.frame_s - motion.gravity_m_per_s2 * motion.frame_s);
    given += lacks[k].squaredNorm();
  }
  for (const FoundBlow& blow : found.blows) {
    const double share = blow.time_s / motion.frame_s;
    const Vector on_body = (blow.a == body ? 1 : -1) * blow.impulse_newton_seconds;
    lacks[blow.frame] -= (1 - share) * on_body;
    lacks[blow.frame + 1] -= share * on_body;
  }
  for (const FoundLoad& load : found.loads) {
    const Vector on_body = (load.a == body ? 1 : -1) * load.force_newtons * motion.frame_s / 6;
    for (size_t k = std::max<size_t>(load.frame, 1) - 1;
         k <= std::min(load.frame + 1, lacks.size() - 1); ++k) {
      lacks[k] -= (k == load.frame ? 4 : 1) * on_body;
    }
  }
  double residual = 0;
  for (size_t k = 1; k + 1 < lacks.size(); ++k) residual += lacks[k].squaredNorm();
  return residual / given;
}

TEST(FindContacts, FindsTheCornersOfABoxWhereverTheyLandInAFrame) {
  // Blows at a frame compete with loads there.
  constexpr int kFalls = 20;
  for (const int rate : {120, 240, 480}) {
    double error = 0;
    for (int i = 0; i < kFalls; ++i) {
      falls::FallScene scene = CornerScene();
      scene.bodies[1].position_m[2] += 0.0013 * i;
      const Fall fall = Drop(scene, falls::FallInBullet, 2400 / rate);
      const FoundContacts found = FindContacts(fall.motion).value();
      const Likeness is = Compare(fall, found);
      EXPECT_GE(is.found_share, rate == 120 ? 0.9 : 0.95) << rate << " " << i;
      EXPECT_LE(is.false_share, 0.05) << rate << " " << i;
      if (i == 0) {
        EXPECT_EQ(is.found_count, is.true_count) << rate;
      }
      EXPECT_LT(is.median_dt_s, rate == 120 ? 1e-3 : 5e-4) << rate << " " << i;
      error += is.median_vector_error / kFalls;
      ExpectOneUnit(fall.motion, found);
      EXPECT_LT(found.confidence.unexplained, rate == 120 ? 0.02 : 0.001) << rate << " " << i;
      EXPECT_LT(LinearlyUnexplained(fall.motion, 1, found), rate == 120 ? 0.02 : 0.005)
          << rate << " " << i;
    }
    EXPECT_LT(error, 0.05) << rate;
  }
}

TEST(FindContacts, FindsMostOfPilesAtSixtyFramesAndCallsThemAmbiguous) {
  constexpr int kPiles = 4;
  double found_share = 0, false_share = 0;
  for (int i = 0; i < kPiles; ++i) {
    const Fall fall = Drop(BlocksScene(i), falls::FallInBullet, 40);
    const FoundContacts found = FindContacts(fall.motion).value();
    const Likeness is = Compare(fall, found);
    found_share += is.found_share / kPiles;
    false_share += is.false_share / kPiles;
    EXPECT_LT(found.confidence.unexplained, 0.001) << i;
    EXPECT_GT(found.confidence.ambiguity, 0.3) << i;
    ExpectOneUnit(fall.motion, found);
  }
  EXPECT_GE(found_share, 0.86);
  EXPECT_LE(false_share, 0.1);
}

TEST(FindContacts, FindsEqualAndOppositeImpulsesInTheAir) {
  for (const int rate : {60, 120, 240}) {
    const Fall fall = Drop(AirScene(), falls::FallInBullet, 2400 / rate);
    const FoundContacts found = FindContacts(fall.motion).value();
    const Likeness is = Compare(fall, found);
    EXPECT_EQ(is.found_count, is.true_count) << rate;
    EXPECT_EQ(is.false_count, 0) << rate;
    EXPECT_LT(is.median_dt_s, 1e-4) << rate;
    EXPECT_LT(is.median_vector_error, 0.01) << rate;
    ExpectOneUnit(fall.motion, found);
  }
}

/// Bullet, which puts down the times, the impulses and the points of its stronger contacts.
struct Struck {
  double time_s = 0, impulse = 0;
  Vector point_m;
};
Engine BulletThatTells(std::vector<Struck>& struck) {
  return [&struck](const falls::FallScene& scene, double step_s) {
    return [&struck, step_s, step_count = 0,
            simulation = falls::FallInBullet(scene, step_s)]() mutable {
      v1::ContactStep step = simulation();
      for (const v1::Contact& contact : step.contacts()) {
        const auto &j = contact.impulse_newton_seconds(), &at = contact.point_m();
        const double impulse = Vector(j.x(), j.y(), j.z()).norm();
        // Bullet applies an impulse at the beginning of its step.
        if (impulse > 0.4) {
          struck.push_back({step_count * step_s, impulse, Vector(at.x(), at.y(), at.z())});
        }
      }
      ++step_count;
      return step;
    };
  };
}

TEST(FindContacts, TellsCornersApartThatLandWithinOneFrame) {
  // Two corners land 1.25 ms apart, and the two others 0.42 ms.
  falls::FallScene scene = CornerScene();
  falls::Body box = BoxBody("box", {0.2, 0.14, 0.06}, 1.21);
  box.position_m = scene.bodies[1].position_m;
  box.orientation = scene.bodies[1].orientation;
  box.velocity_m_per_s = scene.bodies[1].velocity_m_per_s;
  scene.bodies[1] = box;
  scene.seconds = 0.8;
  for (const int rate : {60, 120, 240}) {
    std::vector<Struck> struck;
    const Fall fall = Drop(scene, BulletThatTells(struck), 2400 / rate);
    const FoundContacts found = FindContacts(fall.motion).value();
    ASSERT_EQ(struck.size(), 5U);
    for (const Struck& corner : struck) {
      const auto is_it = [&](const FoundBlow& blow) {
        const double time_s = static_cast<double>(blow.frame) / rate + blow.time_s;
        const Vector& point_m =
            fall.motion.bodies[blow.a].mass_kg > 0 ? blow.point_a_m : blow.point_b_m;
        return std::abs(time_s - corner.time_s) < 2e-4 &&
               (point_m - corner.point_m).norm() < 0.002 &&
               std::abs(blow.impulse_newton_seconds.norm() / corner.impulse - 1) < 0.15;
      };
      EXPECT_TRUE(std::ranges::any_of(found.blows, is_it)) << rate << " " << corner.time_s;
    }
  }
}

TEST(FindContacts, ExplainsAStepThatPushesBothEndsOfABarAtOnce) {
  // One end lands and throws the other down, which the step then stops above the floor. Whether it
  // does so depends on where in a step the bar lands.
  for (const double tilt : {0.1, 0.2, 0.3, 0.4}) {
    for (const double height_m : {0.35, 0.4}) {
      falls::Body bar = BoxBody("bar", {0.3, 0.04, 0.01}, 1);
      bar.position_m = {0, 0, height_m};
      bar.orientation = {std::cos(tilt / 2), 0, std::sin(tilt / 2), 0};
      Fall fall =
          Drop({.friction = 0.25, .restitution = 0, .seconds = 1, .bodies = {FloorBody(), bar}},
               falls::FallInBullet, 1, 1.0 / 240);
      fall.motion.frames_are_steps = true;
      const FoundContacts found = FindContacts(fall.motion).value();
      // If only the lower end may touch, it is above 0.1 in most of these falls.
      EXPECT_LT(found.confidence.unexplained, 3e-4) << tilt << " " << height_m;
      const Likeness is = Compare(fall, found);
      EXPECT_EQ(is.found_count, is.true_count) << tilt << " " << height_m;
      EXPECT_LE(is.false_share, 0.03) << tilt << " " << height_m;
    }
  }
}

TEST(FindContacts, KnowsHowASimulatorDampsABody) {
  constexpr double kDamping = 0.3, kStep = 1.0 / 240, kSide = 0.1;
  Motion motion = OnFloor(BoxBody("cube", {kSide, kSide, kSide}, 1), kStep);
  motion.frames_are_steps = true;
  double height = 0.5, speed = 0, angle = 0, turning = 3;  // about the vertical
  const double kept = std::pow(1 - kDamping, kStep);
  for (int k = 0; k < 240; ++k) {
    motion.bodies[1].poses.push_back(
        {{0, 0, height + kSide / 2}, Turn(Eigen::AngleAxisd(angle, Vector::UnitZ()))});
    speed = height <= 0 && speed < 0 ? -0.9 * speed : kept * speed - kGravity * kStep;
    turning *= kept;
    height += speed * kStep;
    angle += turning * kStep;
  }
  const FoundContacts undamped = FindContacts(motion).value();
  EXPECT_GT(undamped.confidence.unexplained, 1e-5);
  motion.bodies[1].linear_damping = motion.bodies[1].angular_damping = kDamping;
  const FoundContacts damped = FindContacts(motion).value();
  EXPECT_LT(damped.confidence.unexplained, 0.1 * undamped.confidence.unexplained);
}

TEST(FindContacts, TakesRestForALoadOfTheWeight) {
  Motion motion = OnFloor(BoxBody("cube", {0.1, 0.1, 0.1}, 2), Motion().frame_s);
  motion.bodies[1].poses.assign(120, {{0.3, 0, 0.05}, Turn::Identity()});
  const FoundContacts found = FindContacts(motion).value();
  EXPECT_TRUE(found.blows.empty());
  std::vector<double> weight(120, 0);
  for (const FoundLoad& load : found.loads) {
    weight[load.frame] += (load.a == 1 ? 1 : -1) * load.force_newtons.z();
  }
  for (size_t k = 2; k + 2 < weight.size(); ++k) {
    EXPECT_NEAR(weight[k], 2 * kGravity, 0.02 * 2 * kGravity) << k;
  }
}

TEST(FindContacts, FindsTheSameBlowsInATurnedAndShiftedScene) {
  const Fall fall = Drop(CornerScene(), falls::FallInBullet, 20);
  Motion turned = fall.motion;
  const Turn to_y_up(Eigen::AngleAxisd(-std::numbers::pi / 2, Vector::UnitX()));
  turned.gravity_m_per_s2 = to_y_up * turned.gravity_m_per_s2;
  turned.first_time_s = 17;
  for (MovingBody& body : turned.bodies) {
    for (BodyPose& pose : body.poses) {
      pose = {to_y_up * pose.position_m + Vector(1, 2, 3), to_y_up * pose.orientation};
    }
  }
  std::ranges::reverse(turned.bodies);
  const FoundContacts a = FindContacts(fall.motion).value(), b = FindContacts(turned).value();
  const std::vector<PairBlow> first = Clustered(fall.motion, a), second = Clustered(turned, b);
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) {
    EXPECT_NEAR(first[i].time_s, second[i].time_s, 1e-3);
    // The cone of friction and the order of the unknowns leave some freedom.
    EXPECT_NEAR(first[i].impulse.norm(), second[i].impulse.norm(), 0.05 * first[i].impulse.norm());
  }
}

TEST(FindContacts, SaysThatWrongPhysicsDoNotExplainTheMotion) {
  const Fall fall = Drop(CornerScene(), falls::FallInBullet, 20);
  const FoundContacts right = FindContacts(fall.motion).value();
  EXPECT_LT(right.confidence.unexplained, 1e-4);
  Motion weightless = fall.motion;
  weightless.gravity_m_per_s2.setZero();
  Motion heavy = fall.motion;
  heavy.bodies[1].inertia_kg_m2 *= 1.5;
  Motion lone = fall.motion;
  lone.bodies[0].poses[0].position_m.z() = -5;  // no floor is near
  for (const auto& [motion, least] :
       {std::pair{weightless, 0.01}, std::pair{heavy, 5e-4}, std::pair{lone, 0.9}}) {
    const FoundContacts found = FindContacts(motion).value();
    EXPECT_GT(found.confidence.unexplained, least);
    EXPECT_EQ(found.confidence.worst_body, 1U);
  }
}

/// A bar that swings by a hinge at its end, as the equation of the pendulum says.
Motion Pendulum() {
  constexpr double kLength = 0.4, kMass = 0.5, kStepS = 1e-4;
  MovingBody bar = ToMoving(BoxBody("bar", {0.02, 0.02, kLength}, kMass));
  const double across = kMass * kLength * kLength / 12;
  bar.inertia_kg_m2 = Vector(across, across, across / 100).asDiagonal();
  Motion motion;
  const double about_hinge = across + kMass * kLength * kLength / 4;
  double angle = 1, speed = 0;
  for (int i = 0; i <= 10000; ++i) {
    if (i % 100 == 0) {
      const Turn turn(Eigen::AngleAxisd(angle, Vector::UnitY()));
      bar.poses.push_back({turn * Vector(0, 0, -kLength / 2), turn});
    }
    // The midpoint method: its error of 1e-8 is far below the frames' own.
    const double rate = -kMass * kGravity * kLength / 2 / about_hinge;
    const double half = angle + speed * kStepS / 2,
                 half_speed = speed + rate * std::sin(angle) * kStepS / 2;
    angle += half_speed * kStepS;
    speed += rate * std::sin(half) * kStepS;
  }
  motion.frame_s = 0.01;
  motion.bodies = {bar};
  return motion;
}

TEST(FindContacts, ExplainsASwingByItsHinge) {
  Motion motion = Pendulum();
  const FoundContacts alone = FindContacts(motion).value();
  EXPECT_GT(alone.confidence.unexplained, 0.9);
  motion.joints = {
      {.body = 0, .anchor_m = {0, 0, 0.2}, .axis = Vector::UnitY(), .kind = JointKind::kHinge}};
  const FoundContacts hung = FindContacts(motion).value();
  EXPECT_LT(hung.confidence.unexplained, 1e-4);
  EXPECT_TRUE(hung.blows.empty());
}

TEST(FindContacts, RefusesWhatItCannotRead) {
  const Bounce bounce = BallBounce(1 / 60.0, 0);
  const auto reason = [](const Motion& motion) { return FindContacts(motion).status().ToString(); };
  Motion broken = bounce.motion;
  broken.bodies[1].poses[7].position_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(reason(broken), HasSubstr("pose 7 of ball"));
  Motion brief = bounce.motion;
  brief.bodies[1].poses.resize(3);
  EXPECT_THAT(reason(brief), HasSubstr("3 frames"));
  Motion still = bounce.motion;
  still.bodies[1].mass_kg = 0;
  EXPECT_THAT(reason(still), HasSubstr("no body with a mass moves"));
  Motion fast = bounce.motion;
  for (size_t k = 0; k < fast.bodies[1].poses.size(); ++k) {
    fast.bodies[1].poses[k].orientation =
        Turn(Eigen::AngleAxisd(2.8 * static_cast<double>(k), Vector::UnitZ()));
  }
  EXPECT_THAT(reason(fast), HasSubstr("export more frames"));
  EXPECT_TRUE(FindContacts(fast, true).ok());
}

TEST(ToSteps, GivesABlowInTheFrameOfItsBodyAtItsTime) {
  const Fall fall = Drop(CornerScene(), falls::FallInBullet, 20);
  const FoundContacts found = FindContacts(fall.motion).value();
  const std::vector<v1::ContactStep> steps =
      ToSteps(fall.motion, found, {.handles = {0, 7}, .strikers = {"wood", ""}});
  ASSERT_EQ(steps.size(), fall.motion.frame_count());
  size_t impacts = 0;
  for (const v1::ContactStep& step : steps) {
    for (const v1::Contact& row : step.contacts()) {
      EXPECT_EQ(row.object(), 7U);
      const auto& p = row.point_m();
      // Only corners and edges of the box touch the floor.
      EXPECT_NEAR(std::abs(p.x()), 0.06, 0.001);
      EXPECT_NEAR(std::abs(p.y()), 0.045, 0.001);
      EXPECT_NEAR(std::abs(p.z()), 0.03, 0.001);
      if (row.kind() != v1::CONTACT_KIND_IMPACT) continue;
      ++impacts;
      EXPECT_LT(row.time_offset_s(), fall.motion.frame_s);
      EXPECT_EQ(row.hertz().striker(), "wood");
    }
  }
  EXPECT_EQ(impacts, found.blows.size());
  EXPECT_GE(impacts, 7U);
}

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
