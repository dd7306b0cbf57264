// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/hertz.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/excitation/contact.h"

namespace carillon {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr ElasticBody kPlate{
    .young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 0.1, .curvature_per_m = 0};

TEST(Hertz, TheDurationIsThatOfTheFieldEquationsSolution) {
  // m x'' = -4/3 E sqrt(R) x^(3/2), integrated until the bodies part.
  const ElasticBody ball{
      .young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 0.05, .curvature_per_m = 100};
  const double mass = 0.1 / 3, radius = 0.01, speed = 0.7, young = 7e10, poisson = 0.3;
  const double modulus = young / (2 * (1 - poisson * poisson));  // both bodies alike
  double x = 0, v = speed, t = 0;
  for (constexpr double kDt = 1e-9; x >= 0; t += kDt) {
    v -= kDt * 4 / 3 * modulus * std::sqrt(radius) * std::pow(x, 1.5) / mass;
    x += kDt * v;
  }
  // The impulse turns the speed of approach round.
  const double duration_s = HertzDurationS(kPlate, ball, {}, 2 * mass * speed);
  EXPECT_NEAR(duration_s, t, 2e-3 * t);  // 2.87 has three digits
}

TEST(Hertz, ASteelTipTouchesSteelCeramicAndWoodForThePublishedTimes) {
  // 20 g, 5 mm, at 1 m/s: a thick body takes twice the momentum.
  const double impulse = 2 * 0.02;
  const auto duration_ms = [&](double young_pa, double poisson_ratio) {
    const ElasticBody wall{
        .young_pa = young_pa, .poisson_ratio = poisson_ratio, .mass_kg = kInfinity};
    return 1e3 * HertzDurationS(wall, kSteelTip, {}, impulse);
  };
  EXPECT_NEAR(duration_ms(2.06e11, 0.29), 0.067, 0.003);
  EXPECT_NEAR(duration_ms(7e10, 0.2), 0.087, 0.005);
  EXPECT_NEAR(duration_ms(1.2e9, 0.3), 0.41, 0.02);
}

TEST(Hertz, WhatIsToldReplacesWhatTheBodiesSay) {
  const HertzContact told{.reduced_mass_kg = 0.02,
                          .reduced_radius_m = 0.005,
                          .approach_speed_m_per_s = 1,
                          .striker_young_pa = 2.06e11,
                          .striker_poisson_ratio = 0.29};
  const ElasticBody soft{.young_pa = 1e6, .poisson_ratio = 0.4, .mass_kg = 7};
  const ElasticBody wall{.young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = kInfinity};
  EXPECT_DOUBLE_EQ(HertzDurationS(wall, soft, told, 123),
                   HertzDurationS(wall, kSteelTip, {}, 0.04));
}

TEST(Hertz, EvenFlatFacesAndHollowsAndNothingTouchForATime) {
  const ElasticBody flat{.young_pa = 7e10, .poisson_ratio = 0.3, .mass_kg = 1};
  ElasticBody hollow = flat;
  hollow.curvature_per_m = -500;
  const double on_flat = HertzDurationS(flat, flat, {}, 1);
  EXPECT_GT(on_flat, 1e-5);
  EXPECT_EQ(HertzDurationS(hollow, kSteelTip, {.striker_mass_kg = 1}, 1),
            HertzDurationS(hollow, kSteelTip,
                           {.reduced_radius_m = kFlattestRadiusM, .striker_mass_kg = 1}, 1));
  EXPECT_EQ(HertzDurationS(flat, flat, {}, 0), kLongestContactS);  // they do not approach
}

}  // namespace
}  // namespace carillon
