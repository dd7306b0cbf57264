// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/contact.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

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

TEST(Contact, ARoughnessHasADepthAGrainAndASpeed) {
  EXPECT_TRUE(Validate(Roughness{}).ok());
  for (const Roughness& bad :
       {Roughness{.travel_speed_m_per_s = -1}, Roughness{.depth = 11}, Roughness{.depth = kNan},
        Roughness{.irregularity_length_m = 0}, Roughness{.travel_speed_m_per_s = kInfinity}}) {
    EXPECT_THAT(Validate(bad).ToString(), HasSubstr("CONTACT_MALFORMED"));
  }
}

}  // namespace
}  // namespace carillon
