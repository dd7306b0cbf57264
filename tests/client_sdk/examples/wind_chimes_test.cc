// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "client_sdk/examples/wind_chimes/hertz.h"
#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {
namespace {

/// All strikes of the first seconds, as one step without times of their own.
v1::ContactStep StrikesOf(uint64_t seed, double seconds) {
  WindChimes chimes(seed);
  v1::ContactStep all;
  for (int i = 0; i < seconds / WindChimes::kStep_s; ++i) {
    v1::ContactStep step = chimes.Step();
    for (v1::Impulse& strike : *step.mutable_impulses()) {
      strike.set_time_offset_s(strike.time_offset_s() + step.time_s());
    }
    all.MergeFrom(step);
  }
  return all;
}

TEST(WindChimes, OneSeedGivesTheSameStrikesEveryTime) {
  const std::string first = StrikesOf(1, 4).SerializeAsString();
  EXPECT_EQ(first, StrikesOf(1, 4).SerializeAsString());
  EXPECT_NE(first, StrikesOf(2, 4).SerializeAsString());
}

TEST(WindChimes, EveryTubeIsStruckOnItsOuterSurface) {
  const v1::ContactStep strikes = StrikesOf(1, 20);
  std::set<uint32_t> struck;
  for (const v1::Impulse& strike : strikes.impulses()) {
    ASSERT_GE(strike.object(), 1);
    ASSERT_LE(strike.object(), kTubes.size());
    struck.insert(strike.object());
    // Bullet's contact points lie on the shape to within a fraction of its margin of 1 mm.
    const v1::Vec3& point = strike.point_m();
    EXPECT_NEAR(std::hypot(point.x(), point.y()), kOuterRadius_m, 1e-4);
    EXPECT_LE(std::abs(point.z()), kTubes[strike.object() - 1].length_m / 2 + 1e-4);
    // A strike pushes inwards.
    const v1::Vec3& impulse = strike.impulse_newton_seconds();
    EXPECT_LT(impulse.x() * point.x() + impulse.y() * point.y(), 0);
    // A Hertz contact of a few grams at walking speed lasts milliseconds, never nothing.
    EXPECT_GT(strike.duration_s(), 1e-4);
    EXPECT_LT(strike.duration_s(), 5e-3);
  }
  EXPECT_EQ(struck.size(), kTubes.size());
}

TEST(Hertz, DurationGoesWithTheFifthRootOfTheSpeed) {
  const double slow = HertzDuration(0.03, 0.009, 1.4e9, 0.1);
  EXPECT_NEAR(slow / HertzDuration(0.03, 0.009, 1.4e9, 3.2), 2, 1e-12);
  // 2.87 (9e-4/(9e-3 1.96e18 0.1))^(1/5), by hand.
  EXPECT_NEAR(slow, 2.87 * std::pow(5.1020408e-19, 0.2), 1e-9);
}

}  // namespace
}  // namespace carillon::wind_chimes
