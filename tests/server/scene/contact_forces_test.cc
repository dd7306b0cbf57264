// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_forces.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <variant>
#include <vector>

namespace carillon {
namespace {

constexpr double kStepS = 0.01;
constexpr SurfaceImpulse kTen{.at = {.weights = {1, 0, 0}}, .impulse_newton_seconds = {0, 0, 10}};

FeltContact FeltBy(uint32_t handle, const SurfaceImpulse& impulse) {
  return {.by = {Felt{.handle = handle, .event = {.action = impulse}}}, .count = 1};
}

struct Pushed : ForceEvent {
  bool IsKnot() const { return std::holds_alternative<ForceKnot>(action); }
  /// Along z, in newton seconds; none where this is no impulse.
  std::optional<float> Impulse() const {
    const auto* impulse = std::get_if<SurfaceImpulse>(&action);
    return impulse != nullptr ? std::optional(impulse->impulse_newton_seconds[2]) : std::nullopt;
  }
  /// Along z, in newtons; none where this is no force.
  std::optional<float> Force() const {
    const auto* force = std::get_if<SurfaceForce>(&action);
    return force != nullptr ? std::optional(force->force_newtons[2]) : std::nullopt;
  }
};

class ContactForcesTest : public testing::Test {
 protected:
  /// One step, in which `add` says what touches; what it pushed.
  template <typename Add>
  std::vector<Pushed> Step(double time_s, const Add& add) {
    std::vector<Pushed> pushed;
    for (const ForceEvent& event : forces_.Begin(time_s)) pushed.push_back({event});
    add();
    for (const ForceEvent& event : forces_.End()) pushed.push_back({event});
    return pushed;
  }

  std::vector<Pushed> Hold(double time_s, const Roughness& roughness = {}) {
    return Step(time_s, [&] { forces_.Add(FeltBy(3, kTen), roughness); });
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
  EXPECT_EQ(pushed[0].Force(), 10);
  ASSERT_TRUE(pushed[1].IsKnot());
  EXPECT_FLOAT_EQ(std::get<ForceKnot>(pushed[1].action).step_s, 0.01F);
  EXPECT_EQ(pushed[1].time_s, 0.5);
}

TEST_F(ContactForcesTest, WhatIsABlowToOneObjectOfAPairIsABlowToBoth) {
  FeltContact impulse = FeltBy(3, kTen);
  SurfaceImpulse opposite = kTen;
  opposite.impulse_newton_seconds[2] = -10;
  impulse.by[1] = {.handle = 4, .event = {.action = opposite}};
  impulse.count = 2;
  const ObjectTouch touch{.contact = {.handle = 3}, .partner = 9};
  const auto pushed = Step(0, [&] { forces_.Touch(touch, impulse); });
  std::map<uint32_t, float> struck;
  for (const Pushed& push : pushed) {
    struck[push.handle] += push.Impulse().value_or(0);
  }
  EXPECT_GT(struck[3], 1);  // nothing was usual before, so it is mostly a blow
  EXPECT_EQ(struck[4], -struck[3]);
}

TEST_F(ContactForcesTest, EndsAForceWithTwoKnotsAndThenIsStill) {
  Hold(0);
  for (const double time_s : {0.01, 0.02}) {
    const auto pushed = Nothing(time_s);
    ASSERT_EQ(pushed.size(), 1U);
    EXPECT_TRUE(pushed[0].IsKnot());
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
    forces_.Add(FeltBy(3, kTen), {.travel_speed_m_per_s = 2, .depth = 0.4, .grain_m = 0.001});
    forces_.Add(FeltBy(3, kTen), {});  // rests
  });
  const auto& knot = std::get<ForceKnot>(pushed.back().action);
  EXPECT_FLOAT_EQ(knot.roughness, 0.2F);
  EXPECT_FLOAT_EQ(knot.bandwidth_hz, 2000);
}

TEST_F(ContactForcesTest, OfATouchThePartThatIsABlowStrikesAndTheRestIsAForce) {
  const auto touch = [&](double newton_seconds) {
    return [this, newton_seconds] {
      SurfaceImpulse impulse = kTen;
      impulse.impulse_newton_seconds[2] = static_cast<float>(newton_seconds);
      forces_.Touch({.contact = {.handle = 3}, .partner = 9}, FeltBy(3, impulse));
    };
  };
  auto pushed = Step(0, touch(1));  // from flight
  EXPECT_EQ(pushed[0].Impulse(), 1);
  for (int i = 1; i < 20; ++i) pushed = Step(i * kStepS, touch(0.1));
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_FLOAT_EQ(pushed[0].Force().value_or(0), 10);  // 0.1 N s in 0.01 s
  pushed = Step(20 * kStepS, touch(3));
  ASSERT_EQ(pushed.size(), 3U);
  EXPECT_FLOAT_EQ(pushed[0].Impulse().value_or(0), 2.7F);
  EXPECT_FLOAT_EQ(pushed[1].Force().value_or(0), 30);
}

TEST_F(ContactForcesTest, AnotherPartnerIsAnotherPair) {
  const auto touch = [this](uint32_t partner) {
    forces_.Touch({.contact = {.handle = 3}, .partner = partner}, FeltBy(3, kTen));
  };
  for (int i = 0; i < 20; ++i) Step(i * kStepS, [&] { touch(1); });
  const auto pushed = Step(20 * kStepS, [&] {
    touch(1);
    touch(2);
  });
  EXPECT_TRUE(pushed[0].Impulse());
}

}  // namespace
}  // namespace carillon
