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
  const Simulation chimes = Chimes(seed);
  v1::ContactStep all;
  for (int i = 0; i < seconds / kStep_s; ++i) all.MergeFrom(chimes());
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
  for (const v1::Contact& contact : step.contacts()) {
    ASSERT_GE(contact.object(), 1);
    ASSERT_LE(contact.object(), kTubes.size());
    struck.insert(contact.object());
    // A fraction of Bullet's margin of 1 mm.
    constexpr double kOverlap_m = 5e-4;
    const v1::Vec3& point = contact.point_m();
    EXPECT_NEAR(std::hypot(point.x(), point.y()), kOuterRadius_m, kOverlap_m);
    EXPECT_LE(std::abs(point.z()), kTubes[contact.object() - 1].length_m / 2 + 1e-4);
    // The clapper pushes inwards.
    const v1::Vec3& impulse = contact.impulse_newton_seconds();
    constexpr double kRounding = 1e-9;
    EXPECT_LT(impulse.x() * point.x() + impulse.y() * point.y(), kRounding);
    // The daemon computes how long the wooden clapper of 50 g touches.
    EXPECT_FALSE(contact.has_duration_s());
    EXPECT_EQ(contact.has_hertz(), !contact.has_second());
    if (!contact.has_hertz()) continue;
    EXPECT_EQ(contact.hertz().striker(), "wood");
    EXPECT_NEAR(contact.hertz().striker_mass_kg(), 0.05, 1e-12);
  }
  EXPECT_EQ(struck.size(), kTubes.size());
}

TEST(WindChimes, APictureHasThePosesOfAllParts) {
  const Simulation chimes = Chimes(1, Purpose::kPicture);
  v1::ContactStep step;
  for (int i = 0; i < 3 / kStep_s; ++i) step = chimes();
  std::set<uint32_t> posed;
  const v1::PoseColumns& poses = step.poses();
  for (int i = 0; i < poses.object_size(); ++i) {
    posed.insert(poses.object(i));
    if (poses.object(i) != kSailHandle) continue;
    // It hangs below the rest, and the wind has taken it aside.
    EXPECT_LT(poses.position_m(3 * i + 2), -0.5);
    EXPECT_GT(std::hypot(poses.position_m(3 * i), poses.position_m(3 * i + 1)), 0.001);
  }
  EXPECT_EQ(posed, (std::set<uint32_t>{1, 2, 3, 4, 5, 6, kClapperHandle, kSailHandle}));
}

}  // namespace
}  // namespace carillon::wind_chimes
