// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_forces.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace carillon {
namespace {

constexpr double kStepS = 0.01;
constexpr Excitation kTenNewtons{.weights = {1, 0, 0}, .impulse_newton_seconds = {0, 0, 10}};

FeltContact FeltBy(uint32_t handle, const Excitation& excitation) {
  return {.by = {Felt{.handle = handle, .excitation = excitation}}, .count = 1};
}

struct Pushed {
  uint32_t handle;
  Strike strike;
  double time_s;
};

class ContactForcesTest : public testing::Test {
 protected:
  /// One step, in which `add` says what touches; what it pushed.
  template <typename Add>
  std::vector<Pushed> Step(double time_s, const Add& add) {
    std::vector<Pushed> pushed;
    const auto push = [&](uint32_t handle, const Strike& strike, double at_s) {
      pushed.push_back({handle, strike, at_s});
    };
    forces_.Begin(time_s, push);
    add();
    forces_.End(push);
    return pushed;
  }

  std::vector<Pushed> Hold(double time_s, const Roughness& roughness = {}) {
    return Step(time_s, [&] { forces_.Add(FeltBy(3, kTenNewtons), roughness); });
  }

  std::vector<Pushed> Nothing(double time_s) {
    return Step(time_s, [] {});
  }

  ContactForces forces_{kStepS};
};

TEST_F(ContactForcesTest, GivesEachObjectItsForcesAndThenAKnot) {
  const auto pushed = Hold(0.5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_EQ(pushed[0].handle, 3U);
  EXPECT_EQ(pushed[0].strike.kind, StrikeKind::kForce);
  EXPECT_EQ(pushed[0].strike.excitation.impulse_newton_seconds[2], 10);
  EXPECT_EQ(pushed[1].strike.kind, StrikeKind::kKnot);
  EXPECT_FLOAT_EQ(pushed[1].strike.knot.step_s, 0.01F);
  EXPECT_EQ(pushed[1].time_s, 0.5);
}

TEST_F(ContactForcesTest, WhatIsABlowToOneObjectOfAPairIsABlowToBoth) {
  FeltContact impulse = FeltBy(3, kTenNewtons);
  impulse.by[1] = {.handle = 4, .excitation = kTenNewtons};
  impulse.by[1].excitation.impulse_newton_seconds[2] = -10;
  impulse.count = 2;
  const ObjectTouch touch{.handle = 3, .partner = 9};
  const auto pushed = Step(0, [&] { forces_.Touch(touch, impulse); });
  std::map<uint32_t, float> struck;
  for (const Pushed& push : pushed) {
    if (push.strike.kind != StrikeKind::kImpulse) continue;
    struck[push.handle] += push.strike.excitation.impulse_newton_seconds[2];
  }
  EXPECT_GT(struck[3], 1);  // nothing was usual before, so it is mostly a blow
  EXPECT_EQ(struck[4], -struck[3]);
}

TEST_F(ContactForcesTest, EndsAForceWithTwoKnotsAndThenIsStill) {
  Hold(0);
  for (const double time_s : {0.01, 0.02}) {
    const auto pushed = Nothing(time_s);
    ASSERT_EQ(pushed.size(), 1U);
    EXPECT_EQ(pushed[0].strike.kind, StrikeKind::kKnot);
  }
  EXPECT_TRUE(Nothing(0.03).empty());
}

TEST_F(ContactForcesTest, EndsAForceWhereStepsWereLeftOut) {
  Hold(0);
  const auto pushed = Nothing(5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_DOUBLE_EQ(pushed[0].time_s, 0.01);
  EXPECT_DOUBLE_EQ(pushed[1].time_s, 0.02);
}

TEST_F(ContactForcesTest, ARoughnessIsWeighedByItsForce) {
  const auto pushed = Step(0, [&] {
    forces_.Add(FeltBy(3, kTenNewtons),
                {.travel_speed_m_per_s = 2, .depth = 0.4, .grain_m = 0.001});
    forces_.Add(FeltBy(3, kTenNewtons), {});  // rests
  });
  EXPECT_FLOAT_EQ(pushed.back().strike.knot.roughness, 0.2F);
  EXPECT_FLOAT_EQ(pushed.back().strike.knot.bandwidth_hz, 2000);
}

TEST_F(ContactForcesTest, OfATouchThePartThatIsABlowStrikesAndTheRestIsAForce) {
  const auto touch = [&](double newton_seconds) {
    return [this, newton_seconds] {
      Excitation impulse = kTenNewtons;
      impulse.impulse_newton_seconds[2] = static_cast<float>(newton_seconds);
      forces_.Touch({.handle = 3, .partner = 9, .impulse = {}, .roughness = {}},
                    FeltBy(3, impulse));
    };
  };
  auto pushed = Step(0, touch(1));  // from flight
  EXPECT_EQ(pushed[0].strike.kind, StrikeKind::kImpulse);
  EXPECT_EQ(pushed[0].strike.excitation.impulse_newton_seconds[2], 1);
  for (int i = 1; i < 20; ++i) pushed = Step(i * kStepS, touch(0.1));
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_EQ(pushed[0].strike.kind, StrikeKind::kForce);
  EXPECT_FLOAT_EQ(pushed[0].strike.excitation.impulse_newton_seconds[2], 10);  // 0.1 N s in 0.01 s
  pushed = Step(20 * kStepS, touch(3));
  ASSERT_EQ(pushed.size(), 3U);
  EXPECT_FLOAT_EQ(pushed[0].strike.excitation.impulse_newton_seconds[2], 2.7F);
  EXPECT_FLOAT_EQ(pushed[1].strike.excitation.impulse_newton_seconds[2], 30);
}

TEST_F(ContactForcesTest, AnotherPartnerIsAnotherPair) {
  const auto touch = [this](uint32_t partner) {
    forces_.Touch({.handle = 3, .partner = partner, .impulse = {}, .roughness = {}},
                  FeltBy(3, kTenNewtons));
  };
  for (int i = 0; i < 20; ++i) Step(i * kStepS, [&] { touch(1); });
  const auto pushed = Step(20 * kStepS, [&] {
    touch(1);
    touch(2);
  });
  EXPECT_EQ(pushed[0].strike.kind, StrikeKind::kImpulse);
}

}  // namespace
}  // namespace carillon
