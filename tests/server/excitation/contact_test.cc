// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/excitation/load_tracker.h"

namespace carillon {
namespace {

using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ContactImpulse MakeContact() {
  return {.location = Point{0.1, 0.2, 0.3}, .impulse_newton_seconds = {0, 0, -0.02}};
}

TEST(Contact, AnImpulseMustBeFinite) {
  for (const double bad : {kNan, kInfinity, -kInfinity, 4e38, -1e300}) {
    ContactImpulse contact = MakeContact();
    contact.impulse_newton_seconds[1] = bad;
    EXPECT_THAT(Validate(contact).ToString(), HasSubstr("CONTACT_MALFORMED")) << bad;
  }
}

TEST(Contact, ItsDurationLiesFromZeroToATenthOfASecond) {
  for (const double bad : {-1e-9, 0.1001, kNan, kInfinity}) {
    ContactImpulse contact = MakeContact();
    contact.duration_s = bad;
    EXPECT_THAT(Validate(contact).ToString(), HasSubstr("CONTACT_MALFORMED")) << bad;
  }
}

TEST(Contact, BarycentricWeightsAreNotNegativeAndSumToOne) {
  for (const std::array<double, 3>& bad :
       {std::array{0.5, 0.6, -0.1}, std::array{0.3, 0.3, 0.3}, std::array{kNan, 0.5, 0.5}}) {
    EXPECT_THAT(ValidateWeights(bad).ToString(), HasSubstr("CONTACT_MALFORMED"));
  }
  EXPECT_TRUE(ValidateWeights({float{1} / 3, float{1} / 3, 1 - 2 * (float{1} / 3)}).ok());
}

TEST(Contact, TheFiguresOfAnElasticCollisionAreAboveZeroWhereTheyAreKnown) {
  ContactImpulse contact = MakeContact();
  EXPECT_TRUE(Validate(contact).ok());
  for (std::optional<double> HertzContact::*figure :
       {&HertzContact::reduced_mass_kg, &HertzContact::reduced_radius_m,
        &HertzContact::approach_speed_m_per_s, &HertzContact::striker_young_pa,
        &HertzContact::striker_mass_kg, &HertzContact::striker_radius_m}) {
    for (const double bad : {0.0, -1.0, kNan, kInfinity}) {
      ContactImpulse wrong = contact;
      wrong.hertz.*figure = bad;
      EXPECT_THAT(Validate(wrong).ToString(), HasSubstr("CONTACT_MALFORMED")) << bad;
      wrong.hertz.*figure = 0.3;
      EXPECT_TRUE(Validate(wrong).ok());
    }
  }
}

TEST(Contact, ANormalIsADirection) {
  ContactImpulse contact = MakeContact();
  for (const Point& bad : {Point{kNan, 0, 1}, Point{0, kInfinity, 0}}) {
    contact.normal = bad;
    EXPECT_THAT(Validate(contact).ToString(), HasSubstr("CONTACT_MALFORMED: the normal"));
  }
  for (const Point& good : {Point{0, 0, -2}, Point{0, 0, 0}}) {
    contact.normal = good;
    EXPECT_TRUE(Validate(contact).ok());
  }
}

TEST(Contact, ARoughnessHasADepthAGrainAndASpeed) {
  EXPECT_TRUE(Validate(Roughness{}).ok());
  for (const Roughness& bad :
       {Roughness{.travel_speed_m_per_s = -1}, Roughness{.depth = 11}, Roughness{.depth = kNan},
        Roughness{.irregularity_length_m = 0}, Roughness{.travel_speed_m_per_s = kInfinity}}) {
    EXPECT_THAT(Validate(bad).ToString(), HasSubstr("CONTACT_MALFORMED"));
  }
}

constexpr double kStepS = 1.0 / 60;
constexpr double kWeight = 9.81 * kStepS;  // the impulse that holds 1 kg up in one step

TEST(LoadTracker, ABodyThatRestsDoesNotStrikeThoughItsLoadJitters) {
  LoadTracker load;
  for (int i = 0; i < 8; ++i) load.Next(kWeight, kStepS);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(load.Next(kWeight * (1 + 0.5 * std::sin(1e6 * i)), kStepS), 0) << i;
  }
}

// A block that bounces with a restitution of 0.6, in the steps of 20 ms of a controller.
TEST(LoadTracker, ABounceAfterThirtyMillisecondsInTheAirIsABlowWhole) {
  LoadTracker load;
  EXPECT_EQ(load.Next(0.26, 0.02), 1);
  for (int i = 0; i < 6; ++i) load.Next(0, 0.02);
  EXPECT_EQ(load.Next(0.156, 0.02), 1);
  for (int i = 0; i < 3; ++i) load.Next(0, 0.02);
  EXPECT_EQ(load.Next(0.094, 0.02), 1);
  // In steps of 2 ms a gap of three is the jitter of a load.
  LoadTracker fine;
  fine.Next(0.26, 0.002);
  for (int i = 0; i < 3; ++i) fine.Next(0, 0.002);
  EXPECT_LT(fine.Next(0.094, 0.002), 0.1);
}

TEST(LoadTracker, ForgetsAContactThatIsLongOver) {
  LoadTracker load;
  load.Next(1, kStepS);
  EXPECT_FALSE(load.idle());
  for (int i = 0; i < 8; ++i) load.Next(0, kStepS);
  EXPECT_TRUE(load.idle());
}

}  // namespace
}  // namespace carillon
