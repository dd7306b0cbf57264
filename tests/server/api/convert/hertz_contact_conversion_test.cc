// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/hertz_contact_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>

#include "proto/cpp/striker_catalogue.h"

namespace carillon {
namespace {

/// Seconds on thick flat steel at 1 m/s or another speed.
double DurationS(const HertzContact& striker, double speed_m_per_s) {
  const ElasticBody wall{.young_pa = 2.06e11,
                         .poisson_ratio = 0.29,
                         .mass_kg = std::numeric_limits<double>::infinity()};
  HertzContact told = striker;
  told.approach_speed_m_per_s = speed_m_per_s;
  return HertzDurationS(wall, kSteelTip, told, 1);
}

TEST(HertzContactConversion, EveryStrikerHasFiguresASourceAndTheDurationThatItStates) {
  std::set<std::string> names;
  for (const v1::CatalogueStriker& striker : Strikers().strikers()) {
    EXPECT_TRUE(names.insert(striker.name()).second);
    v1::HertzContact named;
    named.set_striker(striker.name());
    const double speed_m_per_s = striker.name() == "felt" ? 2 : 1;
    const std::string& source = striker.source();
    const size_t unit = source.find(speed_m_per_s == 2 ? " ms at 2 m/s" : " ms at 1 m/s");
    ASSERT_NE(unit, std::string::npos) << striker.name();
    const double stated_ms = std::stod(source.substr(source.rfind(' ', unit - 1)));
    EXPECT_NEAR(1e3 * DurationS(*ToHertzContact(named), speed_m_per_s) / stated_ms, 1, 0.05)
        << striker.name();
  }
  EXPECT_EQ(names, (std::set<std::string>{"felt", "fingertip", "rubber", "steel", "wood"}));
}

TEST(HertzContactConversion, TheStrikerOfContactsThatNameNoneIsTheCataloguesSteel) {
  v1::HertzContact named;
  named.set_striker("steel");
  const HertzContact steel = *ToHertzContact(named);
  EXPECT_EQ(steel.striker_young_pa, kSteelTip.young_pa);
  EXPECT_EQ(steel.striker_poisson_ratio, kSteelTip.poisson_ratio);
  EXPECT_EQ(steel.striker_mass_kg, kSteelTip.mass_kg);
  EXPECT_EQ(steel.striker_radius_m, 1 / kSteelTip.curvature_per_m);
  EXPECT_TRUE(steel.striker_mass_is_named);
}

TEST(HertzContactConversion, FiguresOverrideThoseOfTheStriker) {
  v1::HertzContact named;
  named.set_striker("wood");
  named.set_striker_mass_kg(0.5);
  named.set_reduced_radius_m(0.25);
  const HertzContact hertz = *ToHertzContact(named);
  EXPECT_EQ(hertz.striker_mass_kg, 0.5);
  EXPECT_FALSE(hertz.striker_mass_is_named) << "only a stated mass counts as known";
  EXPECT_EQ(hertz.reduced_radius_m, 0.25);
  EXPECT_EQ(hertz.striker_radius_m, 0.005);
  EXPECT_FALSE(hertz.reduced_mass_kg);
  EXPECT_FALSE(ToHertzContact({})->striker_young_pa);
}

TEST(HertzContactConversion, AMaterialIsAFlatFloorThatDoesNotMove) {
  v1::HertzContact named;
  named.set_striker("concrete");
  named.set_striker_poisson_ratio(0.25);
  const HertzContact floor = *ToHertzContact(named);
  EXPECT_EQ(floor.striker_young_pa, 2.6e10);
  EXPECT_EQ(floor.striker_poisson_ratio, 0.25);
  EXPECT_FALSE(floor.striker_mass_is_named);
  const ElasticBody ball{
      .young_pa = 2e11, .poisson_ratio = 0.3, .mass_kg = 1, .curvature_per_m = 40};
  EXPECT_NEAR(ReducedMassKg(ball, kSteelTip, floor), 1, 1e-9);
  HertzContact same = floor;
  same.reduced_radius_m = 1.0 / 40;
  EXPECT_NEAR(HertzDurationS(ball, kSteelTip, floor, 1), HertzDurationS(ball, kSteelTip, same, 1),
              1e-12);
}

}  // namespace
}  // namespace carillon
