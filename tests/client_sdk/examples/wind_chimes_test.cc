// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {
namespace {

/// All contacts of the first seconds, as one step.
v1::ContactStep ContactsOf(uint64_t seed, double seconds) {
  WindChimes chimes(seed);
  v1::ContactStep all;
  for (int i = 0; i < seconds / WindChimes::kStep_s; ++i) all.MergeFrom(chimes.Step());
  return all;
}

TEST(WindChimes, OneSeedGivesTheSameContactsEveryTime) {
  const std::string first = ContactsOf(1, 4).SerializeAsString();
  EXPECT_EQ(first, ContactsOf(1, 4).SerializeAsString());
  EXPECT_NE(first, ContactsOf(2, 4).SerializeAsString());
}

TEST(WindChimes, EveryTubeIsStruckOnItsOuterSurface) {
  const v1::ContactStep step = ContactsOf(1, 20);
  std::set<uint32_t> struck;
  for (const v1::EngineContact& contact : step.contacts()) {
    ASSERT_GE(contact.object(), 1);
    ASSERT_LE(contact.object(), kTubes.size());
    struck.insert(contact.object());
    // Bullet's contact points lie on the shape to within a fraction of its margin of 1 mm.
    const v1::Vec3& point = contact.point_m();
    EXPECT_NEAR(std::hypot(point.x(), point.y()), kOuterRadius_m, 1e-4);
    EXPECT_LE(std::abs(point.z()), kTubes[contact.object() - 1].length_m / 2 + 1e-4);
    // The clapper pushes inwards.
    const v1::Vec3& impulse = contact.impulse_newton_seconds();
    EXPECT_LT(impulse.x() * point.x() + impulse.y() * point.y(), 0);
    // The daemon computes how long the wooden clapper of 50 g touches.
    EXPECT_FALSE(contact.has_duration_s());
    EXPECT_EQ(contact.has_hertz(), !contact.has_second());
    if (!contact.has_hertz()) continue;
    EXPECT_EQ(contact.hertz().striker(), "wood");
    EXPECT_NEAR(contact.hertz().striker_mass_kg(), 0.05, 1e-12);
  }
  EXPECT_EQ(struck.size(), kTubes.size());
}

}  // namespace
}  // namespace carillon::wind_chimes
