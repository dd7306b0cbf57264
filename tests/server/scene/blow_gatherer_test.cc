// SPDX-License-Identifier: Apache-2.0
#include "server/scene/blow_gatherer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace carillon {
namespace {

constexpr double kStepS = 0.01;
constexpr SurfaceImpulse kTen{.at = {.weights = {1, 0, 0}}, .impulse_newton_seconds = {0, 0, 10}};

BodyImpulses ImpulseOn(uint32_t handle, const SurfaceImpulse& impulse) {
  return {.by = {BodyImpulse{.handle = handle, .event = {.action = impulse}}}, .count = 1};
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

class BlowGathererTest : public testing::Test {
 protected:
  /// One step, in which `add` says what touches; what it pushed.
  template <typename Add>
  std::vector<Pushed> Step(double time_s, const Add& add) {
    std::vector<Pushed> pushed;
    for (const ForceEvent& event : gatherer_.Begin(time_s)) pushed.push_back({event});
    add();
    for (const ForceEvent& event : gatherer_.End()) pushed.push_back({event});
    return pushed;
  }

  std::vector<Pushed> Hold(double time_s, const Roughness& roughness = {}) {
    return Step(time_s, [&] { gatherer_.Add(ImpulseOn(3, kTen), roughness); });
  }

  std::vector<Pushed> Nothing(double time_s) {
    return Step(time_s, [] {});
  }

  BlowGatherer gatherer_{kStepS};
};

TEST_F(BlowGathererTest, GivesEachObjectItsForcesAndThenAKnot) {
  const auto pushed = Hold(0.5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_EQ(pushed[0].handle, 3U);
  EXPECT_EQ(pushed[0].Force(), 10);
  ASSERT_TRUE(pushed[1].IsKnot());
  EXPECT_FLOAT_EQ(std::get<ForceKnot>(pushed[1].action).step_s, 0.01F);
  EXPECT_EQ(pushed[1].time_s, 0.5);
}

TEST_F(BlowGathererTest, WhatIsABlowToOneObjectOfAPairIsABlowToBoth) {
  BodyImpulses impulse = ImpulseOn(3, kTen);
  SurfaceImpulse opposite = kTen;
  opposite.impulse_newton_seconds[2] = -10;
  impulse.by[1] = {.handle = 4, .event = {.action = opposite}};
  impulse.count = 2;
  const ObjectTouch touch{.contact = {.handle = 3}, .partner = 9};
  const auto pushed = Step(0, [&] { gatherer_.Touch(touch, impulse); });
  std::map<uint32_t, float> struck;
  for (const Pushed& push : pushed) {
    struck[push.handle] += push.Impulse().value_or(0);
  }
  EXPECT_GT(struck[3], 1);  // nothing was usual before, so it is mostly a blow
  EXPECT_EQ(struck[4], -struck[3]);
}

TEST_F(BlowGathererTest, EndsAForceWithTwoKnotsAndThenIsStill) {
  Hold(0);
  for (const double time_s : {0.01, 0.02}) {
    const auto pushed = Nothing(time_s);
    ASSERT_EQ(pushed.size(), 1U);
    EXPECT_TRUE(pushed[0].IsKnot());
  }
  EXPECT_TRUE(Nothing(0.03).empty());
}

TEST_F(BlowGathererTest, EndsAForceWhereStepsWereLeftOut) {
  Hold(0);
  const auto pushed = Nothing(5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_DOUBLE_EQ(pushed[0].time_s, 0.01);
  EXPECT_DOUBLE_EQ(pushed[1].time_s, 0.02);
}

TEST_F(BlowGathererTest, AfterAGapASmallerContactIsABlowAsIfTheStepsHadBeenSentEmpty) {
  const auto touch = [&](float newton_seconds) {
    return [this, newton_seconds] {
      SurfaceImpulse impulse = kTen;
      impulse.impulse_newton_seconds[2] = newton_seconds;
      gatherer_.Touch({.contact = {.handle = 3}, .partner = 9}, ImpulseOn(3, impulse));
    };
  };
  std::vector<float> blows;
  for (const int i : {0, 1, 2}) {
    for (const Pushed& push : Step(0.3 * i, touch(4.0F / static_cast<float>(1 << i)))) {
      if (push.Impulse()) blows.push_back(*push.Impulse());
    }
  }
  EXPECT_THAT(blows, testing::ElementsAre(4, 2, 1));
  EXPECT_EQ(gatherer_.counts().blow_count, 3U);
  EXPECT_EQ(gatherer_.counts().load_count, 0U);
}

/// The impulse that holds an object of 1 kg up in a step.
constexpr double kWeight = 9.81 * kStepS;

/// Sends `step_count` steps, in which `touch` touches, and one more; the sum of the blows, N s.
template <typename Touch>
double StruckBy(int step_count, const Touch& touch) {
  BlowGatherer gatherer(kStepS);
  double struck = 0;
  const auto add = [&](BlowGatherer::Events events) {
    for (const ForceEvent& event : events) struck += Pushed{event}.Impulse().value_or(0);
  };
  for (int step = 0; step < step_count; ++step) {
    add(gatherer.Begin(step * kStepS));
    touch(gatherer, step);
    add(gatherer.End());
  }
  add(gatherer.Finish());
  return struck;
}

void TouchBy(BlowGatherer& gatherer, uint32_t handle, uint32_t partner, double newton_seconds) {
  SurfaceImpulse impulse = kTen;
  impulse.impulse_newton_seconds[2] = static_cast<float>(newton_seconds);
  gatherer.Touch({.contact = {.handle = handle}, .partner = partner}, ImpulseOn(handle, impulse));
}

TEST(BlowGatherer, WhatRestsWhenTheSimulationBeginsDoesNotStrike) {
  for (const int step_count : {2, 5, 50}) {
    EXPECT_LT(StruckBy(step_count, [](auto& gatherer, int) { TouchBy(gatherer, 3, 1, kWeight); }),
              1e-6);
  }
  // Ten bodies in a pile: the lowest carries ten weights, and hands on nine.
  EXPECT_LT(StruckBy(50,
                     [](auto& gatherer, int) {
                       for (uint32_t body = 1; body <= 10; ++body) {
                         TouchBy(gatherer, body, body - 1, (11 - body) * kWeight);
                         if (body < 10) TouchBy(gatherer, body, body + 1, (body - 10.0) * kWeight);
                       }
                     }),
            1e-6);
  // A blow in the first step strikes at once.
  BlowGatherer gatherer(kStepS);
  gatherer.Begin(0);
  TouchBy(gatherer, 3, 1, 1);
  EXPECT_EQ(Pushed{gatherer.End()[0]}.Impulse(), 1);
}

TEST(BlowGatherer, AFeebleBlowOfOneStepStrikes) {
  for (const int at : {0, 5}) {
    EXPECT_NEAR(StruckBy(20,
                         [at](auto& gatherer, int step) {
                           if (step == at) TouchBy(gatherer, 3, 1, kWeight);
                         }),
                kWeight, 1e-6);
  }
}

TEST(BlowGatherer, AContactThatFlickersDoesNotStrike) {
  for (const int phase : {0, 1}) {
    EXPECT_LT(StruckBy(100,
                       [&](auto& gatherer, int step) {
                         if (step % 2 == phase) TouchBy(gatherer, 3, 1, 2 * kWeight);
                       }),
              1e-6)
        << phase;
  }
}

TEST(BlowGatherer, AStrongImpulseStrikesThoughAFeebleOneCameShortlyBefore) {
  for (const double first : {2.6, 4.0, 10.0}) {
    for (const double feeble : {1.2, 1.8, 2.3}) {
      EXPECT_GT(StruckBy(30,
                         [&](auto& gatherer, int step) {
                           if (step == 9) TouchBy(gatherer, 3, 1, first * kWeight);
                           if (step == 11) TouchBy(gatherer, 3, 1, feeble * kWeight);
                           if (step == 13) TouchBy(gatherer, 3, 1, 100 * kWeight);
                         }),
                95 * kWeight)
          << first << ", " << feeble;
    }
  }
}

TEST(BlowGatherer, TheNoiseOfALoadDoesNotAddUpToABlow) {
  for (const int begin : {0, 60}) {
    for (const double noise : {0.02, 0.2}) {
      for (const uint32_t seed : {1U, 2U, 3U, 4U}) {
        std::minstd_rand random(seed);
        std::uniform_real_distribution<double> part(-noise, noise);
        EXPECT_LT(StruckBy(120,
                           [&](auto& gatherer, int step) {
                             if (step < begin) return;
                             TouchBy(gatherer, 3, 1, (1 + part(random)) * kWeight);
                           }),
                  1e-6)
            << begin << ", " << noise << ", " << seed;
      }
    }
  }
}

TEST(BlowGatherer, ABodyThatChangesItsPartnerWithoutALeapOfItsLoadDoesNotStrike) {
  for (const int steps_each : {1, 2, 24}) {
    EXPECT_LT(StruckBy(200,
                       [&](auto& gatherer, int step) {
                         TouchBy(gatherer, 3, 10 + static_cast<uint32_t>(step / steps_each),
                                 kWeight);
                       }),
              1e-6)
        << steps_each;
  }
  // From another side, or much stronger, the next partner strikes.
  for (const double newton_seconds : {-kWeight, 5 * kWeight}) {
    EXPECT_GT(StruckBy(60,
                       [&](auto& gatherer, int step) {
                         const bool strikes = step == 30;
                         TouchBy(gatherer, 3, strikes ? 11 : 10,
                                 strikes ? newton_seconds : kWeight);
                       }) *
                  (newton_seconds > 0 ? 1 : -1),
              0.8 * kWeight)
        << newton_seconds;
  }
}

TEST_F(BlowGathererTest, WhatRestsIsALoadThoughEverySecondStepIsMissing) {
  uint64_t before = 0;
  for (int i = 0; i < 30; ++i) {
    if (i == 8) before = gatherer_.counts().blow_count;
    Step(2 * i * kStepS,
         [&] { gatherer_.Touch({.contact = {.handle = 3}, .partner = 9}, ImpulseOn(3, kTen)); });
  }
  EXPECT_EQ(gatherer_.counts().blow_count, before);
}

TEST_F(BlowGathererTest, HasRoomForTheGreatestNumberOfContactsAndOfPairs) {
  const auto touch = [](uint32_t partner) {
    return ObjectTouch{.contact = {.handle = 3}, .partner = partner};
  };
  Step(0, [] {});
  for (uint32_t step = 1; step < 3; ++step) {
    gatherer_.Begin(0);
    for (uint32_t i = 0; i < BlowGatherer::kMostTouches; ++i) {
      ASSERT_TRUE(gatherer_.HasRoom(touch(i)));
      gatherer_.Touch(touch(i), ImpulseOn(3, kTen));
    }
    EXPECT_FALSE(gatherer_.HasRoom(touch(0)));
    gatherer_.End();
    EXPECT_TRUE(gatherer_.HasRoom(touch(0)));
    EXPECT_FALSE(gatherer_.HasRoom(touch(BlowGatherer::kMostTouches)));
  }
}

TEST(StepIntervalsTest, TellsARegularGapAndNoOther) {
  constexpr double kRealS = 1.0 / 120;
  StepIntervals alike(1e-3), bounces(1e-3), right(kRealS);
  for (int i = 0; i < 9; ++i) alike.Add(kRealS);
  EXPECT_EQ(alike.RegularGapS(), 0);
  for (int i = 0; i < 10; ++i) alike.Add(1.1 * kRealS);
  EXPECT_NEAR(alike.RegularGapS(), 1.05 * kRealS, 0.01 * kRealS);
  for (int i = 0; i < 4; ++i) alike.Add(2 * kRealS);  // steps that the simulator missed
  EXPECT_NEAR(alike.RegularGapS(), 1.05 * kRealS, 0.01 * kRealS);
  for (int i = 0; i < 4; ++i) alike.Add(3 * kRealS);
  EXPECT_EQ(alike.RegularGapS(), 0);
  for (int i = 0; i < 40; ++i) right.Add(i % 4 == 0 ? 2 * kRealS : kRealS);
  EXPECT_EQ(right.RegularGapS(), 0);
  for (int i = 0; i < 12; ++i) bounces.Add(0.5 - 0.03 * i);
  EXPECT_EQ(bounces.RegularGapS(), 0);
  StepIntervals unbounded(1e-300);
  for (int i = 0; i < 12; ++i) unbounded.Add(1e300);
  EXPECT_NEAR(unbounded.RegularGapS(), 1e300, 1e290);
}

TEST_F(BlowGathererTest, ARoughnessIsWeighedByItsForce) {
  const auto pushed = Step(0, [&] {
    gatherer_.Add(ImpulseOn(3, kTen),
                  {.travel_speed_m_per_s = 2, .depth = 0.4, .irregularity_length_m = 0.001});
    gatherer_.Add(ImpulseOn(3, kTen), {});  // rests
  });
  const auto& knot = std::get<ForceKnot>(pushed.back().action);
  EXPECT_FLOAT_EQ(knot.roughness, 0.2F);
  EXPECT_FLOAT_EQ(knot.bandwidth_hz, 2000);
}

TEST_F(BlowGathererTest, OfATouchThePartThatIsABlowStrikesAndTheRestIsAForce) {
  const auto touch = [&](double newton_seconds) {
    return [this, newton_seconds] {
      SurfaceImpulse impulse = kTen;
      impulse.impulse_newton_seconds[2] = static_cast<float>(newton_seconds);
      gatherer_.Touch({.contact = {.handle = 3}, .partner = 9}, ImpulseOn(3, impulse));
    };
  };
  auto pushed = Step(0, touch(1));  // from flight
  EXPECT_EQ(pushed[0].Impulse(), 1);
  for (int i = 1; i < 20; ++i) pushed = Step(i * kStepS, touch(0.1));
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_FLOAT_EQ(pushed[0].Force().value_or(0), 10);  // 0.1 N s in 0.01 s
  pushed = Step(20 * kStepS, touch(3));
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_FLOAT_EQ(pushed[0].Force().value_or(0), 30);
  pushed = Step(21 * kStepS, touch(0.1));  // the blow is over
  ASSERT_EQ(pushed.size(), 3U);
  EXPECT_FLOAT_EQ(pushed[0].Impulse().value_or(0), 2.7F);
  EXPECT_GE(pushed[0].time_s, 21 * kStepS);  // the load lasts, so the blow is within a step
  EXPECT_LT(pushed[0].time_s, 22 * kStepS);
  EXPECT_EQ(gatherer_.counts().blow_count, 2U);
  EXPECT_EQ(gatherer_.counts().load_count, 20U);
}

TEST_F(BlowGathererTest, AnotherPartnerIsAnotherPair) {
  const auto touch = [this](uint32_t partner) {
    gatherer_.Touch({.contact = {.handle = 3}, .partner = partner}, ImpulseOn(3, kTen));
  };
  for (int i = 0; i < 20; ++i) Step(i * kStepS, [&] { touch(1); });
  const auto pushed = Step(20 * kStepS, [&] {
    touch(1);
    touch(2);
  });
  EXPECT_FALSE(pushed[0].Impulse());
  EXPECT_TRUE(Nothing(21 * kStepS)[0].Impulse());
}

TEST_F(BlowGathererTest, ABlowThatIsNotOverIsSentAtTheEnd) {
  Nothing(0);
  Step(kStepS, [&] { gatherer_.Touch({.contact = {.handle = 3}}, ImpulseOn(3, kTen)); });
  const auto last = gatherer_.Finish();
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(std::get<SurfaceImpulse>(last[0].action).impulse_newton_seconds[2], 10);
  EXPECT_TRUE(gatherer_.Finish().empty());
}

/// The times, in steps, at which a body strikes that hops `hop_count` times, each time after three
/// steps of flight. Each contact has the time offset.
std::vector<double> HopTimes(int hop_count, double time_offset_s, uint32_t partner = 1) {
  BlowGatherer gatherer(kStepS);
  std::vector<double> times;
  for (int step = 0; step < 4 * hop_count; ++step) {
    gatherer.Begin(step * kStepS);
    if (step % 4 == 2) {
      gatherer.Touch({.contact = {.handle = 3}, .partner = partner, .time_offset_s = time_offset_s},
                     ImpulseOn(3, kTen));
    }
    for (const ForceEvent& event : gatherer.End()) {
      if (Pushed{event}.Impulse()) times.push_back(event.time_s / kStepS);
    }
  }
  return times;
}

TEST(BlowGatherer, BlowsOfALastingContactHaveNoLinesAtTheStepRate) {
  const std::vector<double> times = HopTimes(4000, 0);
  ASSERT_EQ(times.size(), 4000U);
  EXPECT_DOUBLE_EQ(times[0], 3);  // after a flight the time is exact
  for (size_t hop = 1; hop < times.size(); ++hop) {
    const double after = times[hop] - 4 * static_cast<double>(hop) - 3;
    ASSERT_TRUE(after > -1e-9 && after < 1 + 1e-9) << after;  // within a step
  }
  for (const double multiple : {1.0, 2.0, 3.0, 10.0}) {
    double cosine = 0, sine = 0;
    for (const double time : times) {
      cosine += std::cos(2 * std::numbers::pi * multiple * time);
      sine += std::sin(2 * std::numbers::pi * multiple * time);
    }
    // On the grid this is 4000; random phases give 63 in the mean and over 200 once in 20,000
    // times.
    EXPECT_LT(std::hypot(cosine, sine), 200) << multiple;
  }
}

TEST(BlowGatherer, TheSameSimulationHasTheSameTimesAndOtherBodiesHaveOthers) {
  EXPECT_EQ(HopTimes(50, 0), HopTimes(50, 0));
  EXPECT_NE(HopTimes(50, 0), HopTimes(50, 0, 2));
}

TEST(BlowGatherer, AContactThatStatesItsTimeOffsetKeepsIt) {
  const std::vector<double> times = HopTimes(50, 0.25 * kStepS);
  for (size_t hop = 0; hop < times.size(); ++hop) {
    EXPECT_NEAR(times[hop], 4 * static_cast<double>(hop) + 3.25, 1e-9);
  }
}

TEST(BlowGatherer, BlowsAfterAFlightOfATenthOfASecondHaveExactTimes) {
  BlowGatherer gatherer(kStepS);
  for (int step = 0; step < 240; ++step) {
    gatherer.Begin(step * kStepS);
    if (step % 12 == 0) gatherer.Touch({.contact = {.handle = 3}}, ImpulseOn(3, kTen));
    for (const ForceEvent& event : gatherer.End()) {
      if (step > 0 && Pushed{event}.Impulse()) {
        EXPECT_EQ(event.time_s, step * kStepS);
      }
    }
  }
  EXPECT_EQ(gatherer.counts().blow_count, 20U);
}

/// A body falls on another with an impulse of 1 N s, of which an engine with soft contacts reports
/// half a sine of `length_s` that begins `phase` steps before a step, and then rests with 1 N.
std::vector<Pushed> Fall(double rate_hz, double length_s, double phase) {
  constexpr double kPi = std::numbers::pi;
  BlowGatherer gatherer(1 / rate_hz);
  std::vector<Pushed> pushed;
  const auto until = [&](double time_s) {  // the part of the impulse up to that time
    return (1 - std::cos(kPi * std::clamp(time_s / length_s, 0.0, 1.0))) / 2;
  };
  for (int step = 0; step < 0.5 * rate_hz; ++step) {
    const double begin_s = (step - 10 + phase) / rate_hz, end_s = begin_s + 1 / rate_hz;
    const double rests = end_s > length_s ? 1 / rate_hz : 0;
    SurfaceImpulse impulse = kTen;
    impulse.impulse_newton_seconds[2] = static_cast<float>(until(end_s) - until(begin_s) + rests);
    for (const ForceEvent& event : gatherer.Begin(step / rate_hz)) pushed.push_back({event});
    if (end_s > 0) {
      BodyImpulses impulses = ImpulseOn(3, impulse);
      impulses.duration_follows_impulse = true;
      std::get<SurfaceImpulse>(impulses.by[0].event.action).pulse =
          Pulse::RaisedCosine(static_cast<float>(
              1e-4 * std::pow(double{impulse.impulse_newton_seconds[2]}, kDurationPower)));
      gatherer.Touch({.contact = {.handle = 3}}, impulses);
    }
    for (const ForceEvent& event : gatherer.End()) pushed.push_back({event});
  }
  return pushed;
}

TEST(BlowGatherer, AFallIsOneBlowOfItsImpulseAndLengthAtEveryStepOfTheEngine) {
  for (const double rate_hz : {60.0, 240.0, 1000.0}) {
    for (const double length_s : {0.002, 0.008, 0.02, 0.03}) {
      for (const double phase : {0.0, 0.3, 0.7}) {
        double sum = 0, largest = 0, duration_s = 0;
        for (const Pushed& push : Fall(rate_hz, length_s, phase)) {
          if (!push.Impulse()) continue;
          sum += *push.Impulse();
          if (*push.Impulse() < largest) continue;
          largest = *push.Impulse();
          duration_s = std::get<SurfaceImpulse>(push.action).pulse.duration_s();
        }
        // Nearly all of it is one blow; the first step of the load may count for it.
        EXPECT_NEAR(20 * std::log10(largest), 0, 1) << rate_hz << " Hz, " << length_s << " s";
        EXPECT_LT(sum - largest, 0.1);
        EXPECT_NEAR(duration_s, 1e-4, 1e-5);
      }
    }
  }
}

/// A body of 1 kg lands with 4 N s at once on `vertices`. Each contact alone would last 1 ms.
std::vector<ForceEvent> Landing(const std::vector<uint32_t>& vertices) {
  BlowGatherer gatherer(kStepS);
  gatherer.Begin(0);
  gatherer.End();
  gatherer.Begin(1);
  for (const uint32_t vertex : vertices) {
    SurfaceImpulse impulse{
        .at = {.vertices = {9, vertex, 8}, .weights = {0, 1, 0}},
        .impulse_newton_seconds = {0, 0, 4.0F / static_cast<float>(vertices.size())},
        .pulse = Pulse::RaisedCosine(1e-3F)};
    BodyImpulses impulses = ImpulseOn(3, impulse);
    impulses.by[0].collision.reduced_mass_kg = 1;
    impulses.duration_follows_impulse = true;
    gatherer.Touch({.contact = {.handle = 3}}, impulses);
  }
  const BlowGatherer::Events events = gatherer.End();
  std::vector<ForceEvent> blows;
  std::ranges::copy_if(events, std::back_inserter(blows), [](const ForceEvent& event) {
    return std::holds_alternative<SurfaceImpulse>(event.action);
  });
  return blows;
}

double DurationS(const ForceEvent& blow) {
  return double{std::get<SurfaceImpulse>(blow.action).pulse.duration_s()};
}

TEST(BlowGatherer, CornersThatLandTogetherShareTheMassAndHaveOneSpeed) {
  const std::vector<ForceEvent> blows = Landing({0, 1, 2, 3});
  ASSERT_EQ(blows.size(), 4U);
  for (const ForceEvent& blow : blows) {
    // T = 2.87 (m^2/(R E^2 v))^(1/5): a quarter of the mass, and four times the speed J/(2 m).
    EXPECT_NEAR(DurationS(blow), 1e-3 * std::pow(1.0 / 16 / 4, 0.2), 1e-9);
    EXPECT_DOUBLE_EQ(blow.collision.reduced_mass_kg, 0.25);
  }
}

TEST(BlowGatherer, ContactsAtOnePlaceAreOneContact) {
  // An engine may report the contact of a corner once for each triangle of the floor.
  const std::vector<ForceEvent> blows = Landing({1, 1});
  ASSERT_EQ(blows.size(), 2U);
  for (const ForceEvent& blow : blows) {
    EXPECT_NEAR(DurationS(blow), 1e-3 * std::pow(1.0 / 2, 0.2), 1e-9);
  }
  EXPECT_NEAR(DurationS(Landing({1}).at(0)), 1e-3, 1e-9);
}

/// The speed that a body of half implicit steps has in the step in which it meets the floor, m/s.
constexpr double kFallMPerS = 9.81 * kStepS * 20;

/// Lets a body of 1 kg fall for 19 steps, with a pose in each, and land in the next one with
/// `impulses`. Returns its blows.
std::vector<ForceEvent> Fall(std::span<const BodyImpulses> impulses, double leap_m = 0) {
  BlowGatherer gatherer(kStepS);
  double height_m = 1;
  for (int step = 1; step < 20; ++step) {
    gatherer.Begin(step * kStepS);
    height_m -= 9.81 * kStepS * kStepS * step;
    gatherer.Move(3, 1, {.position_m = {0, 0, step < 18 ? height_m + leap_m : height_m}});
    gatherer.End();
  }
  gatherer.Begin(20 * kStepS);
  gatherer.Move(3, 1, {.position_m = {0, 0, height_m}});
  for (const BodyImpulses& impulse : impulses) gatherer.Touch({.contact = {.handle = 3}}, impulse);
  std::vector<ForceEvent> blows;
  const auto add = [&](BlowGatherer::Events events) {
    std::ranges::copy_if(events, std::back_inserter(blows), [](const ForceEvent& event) {
      return std::holds_alternative<SurfaceImpulse>(event.action);
    });
  };
  add(gatherer.End());
  add(gatherer.Finish());
  return blows;
}

/// An impulse at a vertex, whose duration of 1 ms is that of a collision of 1 kg at J/(2 m).
BodyImpulses Landing(double newton_seconds, uint32_t vertex = 0) {
  const SurfaceImpulse impulse{.at = {.vertices = {vertex, 8, 9}, .weights = {1, 0, 0}},
                               .impulse_newton_seconds = {0, 0, static_cast<float>(newton_seconds)},
                               .pulse = Pulse::RaisedCosine(1e-3F)};
  BodyImpulses impulses = ImpulseOn(3, impulse);
  impulses.by[0].collision.reduced_mass_kg = 1;
  impulses.duration_follows_impulse = true;
  return impulses;
}

/// The duration after Hertz of a collision of 1 kg that takes 1 ms at another speed, s.
double AtSpeed(double m_per_s, double one_ms_at_m_per_s) {
  return 1e-3 * std::pow(m_per_s / one_ms_at_m_per_s, -0.2);
}

TEST(BlowGatherer, ABlowHasTheSpeedOfThePosesWhateverTheRestitution) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    const double impulse = (1 + restitution) * kFallMPerS;
    const std::vector<ForceEvent> blows = Fall(std::array{Landing(impulse)});
    ASSERT_EQ(blows.size(), 1U);
    EXPECT_NEAR(DurationS(blows[0]), AtSpeed(kFallMPerS, impulse / 2), 1e-9) << restitution;
    EXPECT_NEAR(blows[0].collision.stated_speed_m_per_s, kFallMPerS, 1e-9) << restitution;
  }
}

TEST(BlowGatherer, ASpeedThatTheImpulseContradictsDoesNotCount) {
  const std::pair<double, double> contradictions[] = {
      {kFallMPerS, 20},        // it was put elsewhere just before
      {4 * kFallMPerS, 0},     // it was struck by what moves
      {0.2 * kFallMPerS, 0}};  // it only grazed the floor
  for (const auto& [impulse, leap_m] : contradictions) {
    const std::vector<ForceEvent> blows = Fall(std::array{Landing(impulse)}, leap_m);
    ASSERT_EQ(blows.size(), 1U);
    EXPECT_NEAR(DurationS(blows[0]), 1e-3, 1e-9) << impulse;
    EXPECT_EQ(blows[0].collision.stated_speed_m_per_s, 0) << impulse;
  }
}

TEST(BlowGatherer, AStatedMassOrSpeedStays) {
  BodyImpulses of_mass = Landing(kFallMPerS), of_speed = Landing(kFallMPerS);
  of_mass.mass_is_stated = true;
  of_mass.by[0].mass_kg = 3;
  of_speed.duration_follows_impulse = false;
  of_speed.by[0].collision.stated_speed_m_per_s = 7;
  EXPECT_EQ(Fall(std::array{of_mass}).at(0).collision.reduced_mass_kg, 1);
  const ForceEvent blow = Fall(std::array{of_speed}).at(0);
  EXPECT_NEAR(DurationS(blow), 1e-3, 1e-9);
  EXPECT_EQ(blow.collision.stated_speed_m_per_s, 7);
}

TEST(BlowGatherer, ACornerBringsLessMassToRestThanAFaceWhoseTurnsCancel) {
  BodyImpulses left = Landing(kFallMPerS / 2, 0), right = Landing(kFallMPerS / 2, 1);
  left.by[0].turn[1] = kFallMPerS;
  right.by[0].turn[1] = -kFallMPerS;
  left.by[0].collision.reduced_mass_kg = right.by[0].collision.reduced_mass_kg = 0.2;
  const std::vector<ForceEvent> face = Fall(std::array{left, right});
  ASSERT_EQ(face.size(), 2U);
  for (const ForceEvent& blow : face) EXPECT_NEAR(blow.collision.reduced_mass_kg, 0.5, 1e-6);
  // 1/m = 1/M + turn^2/J^2 = 1 + 4
  EXPECT_NEAR(Fall(std::array{left}).at(0).collision.reduced_mass_kg, 0.2, 1e-6);
}

TEST(BlowGatherer, ABodyThatFallsOnAnUnknownOneMeetsAFloorAndNotAHammer) {
  BodyImpulses impulse = Landing(1.5 * kFallMPerS);
  impulse.striker_per_kg = std::nullopt;
  impulse.by[0].collision.reduced_mass_kg = 0.02;
  const ForceEvent blow = Fall(std::array{impulse}).at(0);
  EXPECT_NEAR(blow.collision.reduced_mass_kg, 1, 1e-9);
  EXPECT_NEAR(DurationS(blow), AtSpeed(kFallMPerS, 1.5 * kFallMPerS / 0.04) * std::pow(50, 0.4),
              1e-9);
  // What strikes a body is a hammer.
  impulse = Landing(0.1 * kFallMPerS);
  impulse.striker_per_kg = std::nullopt;
  impulse.by[0].collision.reduced_mass_kg = 0.02;
  EXPECT_NEAR(Fall(std::array{impulse}).at(0).collision.reduced_mass_kg, 0.02, 1e-9);
}

TEST(BlowGatherer, ABodyThatIsPutDownGentlyDoesNotStrike) {
  for (const double rate_hz : {240.0, 1000.0}) {
    BlowGatherer gatherer(1 / rate_hz);
    double struck = 0;
    for (int step = 0; step < 0.3 * rate_hz; ++step) {
      SurfaceImpulse impulse = kTen;
      const double newtons = std::clamp((step - 10) / rate_hz / 0.02, 0.0, 1.0);
      impulse.impulse_newton_seconds[2] = static_cast<float>(newtons / rate_hz);
      gatherer.Begin(step / rate_hz);
      if (newtons > 0) gatherer.Touch({.contact = {.handle = 3}}, ImpulseOn(3, impulse));
      for (const ForceEvent& event : gatherer.End()) struck += Pushed{event}.Impulse().value_or(0);
    }
    EXPECT_LT(struck, 1e-3) << rate_hz;  // newton seconds; the first step alone would be 0.004
  }
}

/// The impulses of 1 N s that an engine reports in equal parts, or as half a sine, in `step_count`
/// steps. Returns those of the blows.
std::vector<float> BlowsOfSpread(double rate_hz, int step_count, bool half_sine) {
  BlowGatherer gatherer(1 / rate_hz);
  std::vector<double> parts(static_cast<size_t>(step_count), 1);
  if (half_sine) {
    for (size_t i = 0; i < parts.size(); ++i) {
      parts[i] = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / step_count);
    }
  }
  const double whole = std::accumulate(parts.begin(), parts.end(), 0.0);
  std::vector<float> blows;
  for (size_t step = 0; step < 2 * parts.size() + 20; ++step) {
    gatherer.Begin(static_cast<double>(step) / rate_hz);
    if (step >= 10 && step - 10 < parts.size()) {
      SurfaceImpulse impulse = kTen;
      impulse.impulse_newton_seconds[2] = static_cast<float>(parts[step - 10] / whole);
      gatherer.Touch({.contact = {.handle = 3}}, ImpulseOn(3, impulse));
    }
    for (const ForceEvent& event : gatherer.End()) {
      if (const auto impulse = Pushed{event}.Impulse()) blows.push_back(*impulse);
    }
  }
  return blows;
}

TEST(BlowGatherer, AnImpactThatIsSpreadOverEightStepsOrATenthOfASecondLosesNoImpulse) {
  const std::pair<double, int> spreads[] = {{30, 5},   {30, 8},   {60, 2},    {60, 3},
                                            {60, 5},   {60, 8},   {120, 12},  {240, 12},
                                            {240, 23}, {1000, 8}, {1000, 45}, {1000, 99}};
  for (const auto& [rate_hz, step_count] : spreads) {
    const std::vector<float> equal = BlowsOfSpread(rate_hz, step_count, false);
    ASSERT_EQ(equal.size(), 1U) << rate_hz << " Hz, " << step_count;
    EXPECT_NEAR(equal[0], 1, 1e-5) << rate_hz << " Hz, " << step_count;
    const std::vector<float> sine = BlowsOfSpread(rate_hz, step_count, true);
    ASSERT_EQ(sine.size(), 1U) << rate_hz << " Hz, " << step_count;
    // The end of the sine, below a quarter of its greatest step, is no part of the blow.
    EXPECT_NEAR(20 * std::log10(sine[0]), 0, 0.4) << rate_hz << " Hz, " << step_count;
  }
}

TEST(BlowGatherer, ABodyThatIsPutDownAndSlidesIsHeardAfter40Milliseconds) {
  BlowGatherer gatherer(0.004);
  double begin_s = 0;
  for (int step = 0; step < 60 && begin_s == 0; ++step) {
    const Roughness roughness{.travel_speed_m_per_s = 1, .depth = 0.3};
    gatherer.Begin(step * 0.004);
    if (step >= 10) {
      gatherer.Touch({.contact = {.handle = 3}, .roughness = roughness}, ImpulseOn(3, kTen));
    }
    for (const ForceEvent& event : gatherer.End()) {
      const auto* knot = std::get_if<ForceKnot>(&event.action);
      if (knot != nullptr && knot->bandwidth_hz > 0) begin_s = event.time_s - 10 * 0.004;
    }
  }
  EXPECT_NEAR(begin_s, 0.04, 0.001);
}

}  // namespace
}  // namespace carillon
