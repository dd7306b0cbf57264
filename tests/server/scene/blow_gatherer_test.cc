// SPDX-License-Identifier: Apache-2.0
#include "server/scene/blow_gatherer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <utility>
#include <variant>
#include <vector>

namespace carillon {
namespace {

constexpr double kStepS = 0.01;

/// Along z, at a vertex.
SurfaceImpulse AlongZ(double newton_seconds, uint32_t vertex = 0) {
  return {.at = {.vertices = {9, vertex, 8}, .weights = {0, 1, 0}},
          .impulse_newton_seconds = {0, 0, static_cast<float>(newton_seconds)}};
}

BodyImpulses ImpulseOn(uint32_t handle, const SurfaceImpulse& impulse) {
  const auto& [x, y, z] = impulse.impulse_newton_seconds;
  return {
      .by = {BodyImpulse{.handle = handle, .event = {.action = impulse}, .pressing = {x, y, z}}},
      .count = 1};
}

void TouchBy(BlowGatherer& gatherer, double newton_seconds, uint32_t partner = 9,
             uint32_t handle = 3) {
  gatherer.Touch({.contact = {.handle = handle}, .partner = partner},
                 ImpulseOn(handle, AlongZ(newton_seconds)));
}

bool IsKnot(const ForceEvent& event) { return std::holds_alternative<ForceKnot>(event.action); }

/// Along z, in newton seconds; none where this is no impulse.
std::optional<float> ImpulseOf(const ForceEvent& event) {
  const auto* impulse = std::get_if<SurfaceImpulse>(&event.action);
  return impulse != nullptr ? std::optional(impulse->impulse_newton_seconds[2]) : std::nullopt;
}

/// Along z, in newtons; none where this is no force.
std::optional<float> ForceOf(const ForceEvent& event) {
  const auto* force = std::get_if<SurfaceForce>(&event.action);
  return force != nullptr ? std::optional(force->force_newtons[2]) : std::nullopt;
}

double DurationS(const ForceEvent& blow) {
  return double{std::get<SurfaceImpulse>(blow.action).pulse.duration_s()};
}

/// Sends `step_count` steps, in which `touch(gatherer, step)` touches, and ends the simulation.
/// Returns the blows.
template <typename Touch>
std::vector<ForceEvent> BlowsOf(int step_count, const Touch& touch, double step_s = kStepS) {
  BlowGatherer gatherer(step_s);
  std::vector<ForceEvent> blows;
  const auto add = [&](BlowGatherer::Events events) {
    for (const ForceEvent& event : events) {
      if (ImpulseOf(event)) blows.push_back(event);
    }
  };
  for (int step = 0; step < step_count; ++step) {
    add(gatherer.Begin(step * step_s));
    touch(gatherer, step);
    add(gatherer.End());
  }
  add(gatherer.Finish());
  return blows;
}

/// The sum of those blows, N s.
template <typename Touch>
double StruckBy(int step_count, const Touch& touch, double step_s = kStepS) {
  double struck = 0;
  for (const ForceEvent& blow : BlowsOf(step_count, touch, step_s)) struck += *ImpulseOf(blow);
  return struck;
}

class BlowGathererTest : public testing::Test {
 protected:
  /// One step, in which `add` says what touches; what it pushed.
  template <typename Add>
  std::vector<ForceEvent> Step(double time_s, const Add& add) {
    const BlowGatherer::Events ended = gatherer_.Begin(time_s);
    std::vector<ForceEvent> pushed(ended.begin(), ended.end());
    add();
    std::ranges::copy(gatherer_.End(), std::back_inserter(pushed));
    return pushed;
  }

  std::vector<ForceEvent> Hold(double time_s) {
    return Step(time_s, [this] { gatherer_.Add(ImpulseOn(3, AlongZ(10)), {}); });
  }
  std::vector<ForceEvent> Touch(double time_s, double newton_seconds) {
    return Step(time_s, [&] { TouchBy(gatherer_, newton_seconds); });
  }
  std::vector<ForceEvent> Nothing(double time_s) {
    return Step(time_s, [] {});
  }

  BlowGatherer gatherer_{kStepS};
};

TEST_F(BlowGathererTest, GivesEachObjectItsForcesAndThenAKnot) {
  const auto pushed = Hold(0.5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_EQ(pushed[0].handle, 3U);
  EXPECT_EQ(ForceOf(pushed[0]), 10);
  ASSERT_TRUE(IsKnot(pushed[1]));
  EXPECT_FLOAT_EQ(std::get<ForceKnot>(pushed[1].action).step_s, 0.01F);
  EXPECT_EQ(pushed[1].time_s, 0.5);
}

TEST_F(BlowGathererTest, WhatIsABlowToOneObjectOfAPairIsABlowToBoth) {
  BodyImpulses impulse = ImpulseOn(3, AlongZ(10));
  impulse.by[1] = {.handle = 4, .event = {.action = AlongZ(-10)}};
  impulse.count = 2;
  const ObjectTouch touch{.contact = {.handle = 3}, .partner = 9};
  std::map<uint32_t, float> struck;
  for (const ForceEvent& event : Step(0, [&] { gatherer_.Touch(touch, impulse); })) {
    struck[event.handle] += ImpulseOf(event).value_or(0);
  }
  EXPECT_GT(struck[3], 1);  // nothing was usual before, so it is mostly a blow
  EXPECT_EQ(struck[4], -struck[3]);
}

TEST_F(BlowGathererTest, EndsAForceWithTwoKnotsAndThenIsStill) {
  Hold(0);
  for (const double time_s : {0.01, 0.02}) {
    const auto pushed = Nothing(time_s);
    ASSERT_EQ(pushed.size(), 1U);
    EXPECT_TRUE(IsKnot(pushed[0]));
  }
  EXPECT_TRUE(Nothing(0.03).empty());
  // Where steps were left out, the force ends as if they had been sent.
  Hold(1);
  const auto pushed = Nothing(5);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_DOUBLE_EQ(pushed[0].time_s, 1.01);
  EXPECT_DOUBLE_EQ(pushed[1].time_s, 1.02);
}

TEST_F(BlowGathererTest, AfterAGapASmallerContactIsABlowAsIfTheStepsHadBeenSentEmpty) {
  std::vector<float> blows;
  for (const int i : {0, 1, 2}) {
    for (const ForceEvent& event : Touch(0.3 * i, 4.0 / (1 << i))) {
      if (ImpulseOf(event)) blows.push_back(*ImpulseOf(event));
    }
  }
  EXPECT_THAT(blows, testing::ElementsAre(4, 2, 1));
  EXPECT_EQ(gatherer_.counts().blow_count, 3U);
  EXPECT_EQ(gatherer_.counts().load_count, 0U);
}

/// The impulse that holds an object of 1 kg up in a step.
constexpr double kWeight = 9.81 * kStepS;

/// The blows of a body of 1 kg that rests for `rests_s` and, after a gap, for 40 steps more, N s.
/// The first step after the gap has the impulse that the body gets in `weighs_s`. Before, there may
/// be steps without contacts.
std::vector<float> Stutter(double rate_hz, double gap_s, double weighs_s, int empty_count = 5) {
  BlowGatherer gatherer(1 / rate_hz);
  std::vector<float> blows;
  double time_s = 0;
  const int last = static_cast<int>(0.3 * rate_hz) + empty_count;
  for (int step = 0; step < last + 40; ++step) {
    time_s += step == last ? gap_s : 1 / rate_hz;
    for (const ForceEvent& event : gatherer.Begin(time_s)) {
      if (ImpulseOf(event)) blows.push_back(*ImpulseOf(event));
    }
    const double impulse = 9.81 * (step == last ? weighs_s : 1 / rate_hz);
    if (step >= empty_count) TouchBy(gatherer, impulse);
    for (const ForceEvent& event : gatherer.End()) {
      if (ImpulseOf(event)) blows.push_back(*ImpulseOf(event));
    }
  }
  return blows;
}

TEST(BlowGatherer, ABodyAtRestDoesNotStrikeWhenAGameStutters) {
  for (const double rate_hz : {60.0, 240.0, 1000.0}) {
    for (const double gap_s : {1.6 / rate_hz, 2 / rate_hz, 0.1, 0.3}) {
      EXPECT_TRUE(Stutter(rate_hz, gap_s, gap_s).empty()) << rate_hz << " Hz, " << gap_s << " s";
      // What exceeds the load by far is a blow all the same.
      const std::vector<float> struck = Stutter(rate_hz, gap_s, 10 * gap_s);
      ASSERT_EQ(struck.size(), 1U) << rate_hz << " Hz, " << gap_s << " s";
      EXPECT_GT(struck[0], 0.65 * 98.1 * gap_s);  // Up to three times the load may be a load.
    }
    // A body that is thrown up lands as hard. Its client may leave out the steps of the flight.
    const std::vector<float> thrown = Stutter(rate_hz, 0.3, 0.24, 0);
    ASSERT_EQ(thrown.size(), 1U) << rate_hz << " Hz";
    EXPECT_NEAR(thrown[0], 9.81 * 0.24, 1e-5) << rate_hz << " Hz";
  }
}

TEST(BlowGatherer, OfSeveralBodiesAtRestNoneStrikesWhenAGameStutters) {
  BlowGatherer gatherer(1.0 / 60);
  for (int step = 0; step < 60; ++step) {
    const int steps = step < 40 ? 1 : 18;
    for (const ForceEvent& event : gatherer.Begin((step + (step < 40 ? 0 : 17)) / 60.0)) {
      EXPECT_FALSE(ImpulseOf(event));
    }
    for (const uint32_t body : {3U, 4U, 5U}) {
      TouchBy(gatherer, 9.81 * (step == 40 ? steps : 1) / 60, 9, body);
    }
    for (const ForceEvent& event : gatherer.End()) EXPECT_FALSE(ImpulseOf(event));
  }
}

TEST(BlowGatherer, ABodyAtRestDoesNotStrikeInStepsOfAnyLength) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> length_s(1.0 / 200, 1.0 / 30);
  for (int run = 0; run < 40; ++run) {
    BlowGatherer gatherer(1.0 / 60);
    double time_s = 0, struck = 0;
    for (int step = 0; step < 200; ++step) {
      const double step_s = length_s(random);
      time_s += step_s;
      for (const ForceEvent& event : gatherer.Begin(time_s)) struck += ImpulseOf(event).value_or(0);
      TouchBy(gatherer, 9.81 * step_s);
      for (const ForceEvent& event : gatherer.End()) struck += ImpulseOf(event).value_or(0);
    }
    EXPECT_EQ(struck, 0) << run;
  }
}

TEST(BlowGatherer, WhatRestsWhenTheSimulationBeginsDoesNotStrike) {
  for (const int step_count : {2, 5, 50}) {
    EXPECT_LT(StruckBy(step_count, [](auto& gatherer, int) { TouchBy(gatherer, kWeight); }), 1e-6);
  }
  // Ten bodies in a pile: the lowest carries ten weights, and hands on nine.
  EXPECT_LT(StruckBy(50,
                     [](auto& gatherer, int) {
                       for (uint32_t body = 1; body <= 10; ++body) {
                         TouchBy(gatherer, (11 - body) * kWeight, body - 1, body);
                         if (body < 10) TouchBy(gatherer, (body - 10.0) * kWeight, body + 1, body);
                       }
                     }),
            1e-6);
  // A blow in the first step strikes at once.
  BlowGatherer gatherer(kStepS);
  gatherer.Begin(0);
  TouchBy(gatherer, 1);
  EXPECT_EQ(ImpulseOf(gatherer.End()[0]), 1);
}

TEST(BlowGatherer, AFeebleBlowOfOneStepStrikes) {
  for (const int at : {0, 5}) {
    const auto touch = [at](auto& gatherer, int step) {
      if (step == at) TouchBy(gatherer, kWeight);
    };
    EXPECT_NEAR(StruckBy(20, touch), kWeight, 1e-6);
  }
}

TEST(BlowGatherer, AContactThatFlickersDoesNotStrike) {
  for (const int phase : {0, 1}) {
    const auto touch = [phase](auto& gatherer, int step) {
      if (step % 2 == phase) TouchBy(gatherer, 2 * kWeight);
    };
    EXPECT_LT(StruckBy(100, touch), 1e-6) << phase;
  }
}

TEST(BlowGatherer, AStrongImpulseStrikesThoughAFeebleOneCameShortlyBefore) {
  for (const double first : {2.6, 4.0, 10.0}) {
    for (const double feeble : {1.2, 1.8, 2.3}) {
      const auto touch = [&](auto& gatherer, int step) {
        if (step == 9) TouchBy(gatherer, first * kWeight);
        if (step == 11) TouchBy(gatherer, feeble * kWeight);
        if (step == 13) TouchBy(gatherer, 100 * kWeight);
      };
      EXPECT_GT(StruckBy(30, touch), 95 * kWeight) << first << ", " << feeble;
    }
  }
}

TEST(BlowGatherer, TheNoiseOfALoadDoesNotAddUpToABlow) {
  for (const int begin : {0, 60}) {
    for (const double noise : {0.02, 0.2}) {
      for (const uint32_t seed : {1U, 2U, 3U, 4U}) {
        std::minstd_rand random(seed);
        std::uniform_real_distribution<double> part(-noise, noise);
        const auto touch = [&](auto& gatherer, int step) {
          if (step >= begin) TouchBy(gatherer, (1 + part(random)) * kWeight);
        };
        EXPECT_LT(StruckBy(120, touch), 1e-6) << begin << ", " << noise << ", " << seed;
      }
    }
  }
}

TEST(BlowGatherer, ABodyThatChangesItsPartnerWithoutALeapOfItsLoadDoesNotStrike) {
  for (const int steps_each : {1, 2, 24}) {
    const auto touch = [&](auto& gatherer, int step) {
      TouchBy(gatherer, kWeight, 10 + static_cast<uint32_t>(step / steps_each));
    };
    EXPECT_LT(StruckBy(200, touch), 1e-6) << steps_each;
  }
  // From another side, or much stronger, the next partner strikes.
  for (const double newton_seconds : {-kWeight, 5 * kWeight}) {
    const auto touch = [&](auto& gatherer, int step) {
      const bool strikes = step == 30;
      TouchBy(gatherer, strikes ? newton_seconds : kWeight, strikes ? 11 : 10);
    };
    EXPECT_GT(StruckBy(60, touch) * (newton_seconds > 0 ? 1 : -1), 0.8 * kWeight) << newton_seconds;
  }
}

TEST_F(BlowGathererTest, WhatRestsIsALoadThoughEverySecondStepIsMissing) {
  for (int i = 0; i < 8; ++i) Touch(2 * i * kStepS, 10);
  const uint64_t before = gatherer_.counts().blow_count;
  for (int i = 8; i < 30; ++i) Touch(2 * i * kStepS, 10);
  EXPECT_EQ(gatherer_.counts().blow_count, before);
}

TEST_F(BlowGathererTest, HasRoomForTheGreatestNumberOfContactsAndOfPairs) {
  const auto touch = [](uint32_t partner) {
    return ObjectTouch{.contact = {.handle = 3}, .partner = partner};
  };
  Nothing(0);
  for (uint32_t step = 1; step < 3; ++step) {
    gatherer_.Begin(0);
    for (uint32_t i = 0; i < BlowGatherer::kMostTouches; ++i) {
      ASSERT_TRUE(gatherer_.HasRoom(touch(i)));
      TouchBy(gatherer_, 10, i);
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
    gatherer_.Add(ImpulseOn(3, AlongZ(10)),
                  {.travel_speed_m_per_s = 2, .depth = 0.4, .irregularity_length_m = 0.001});
    gatherer_.Add(ImpulseOn(3, AlongZ(10)), {});  // rests
  });
  const auto& knot = std::get<ForceKnot>(pushed.back().action);
  EXPECT_FLOAT_EQ(knot.roughness, 0.2F);
  EXPECT_FLOAT_EQ(knot.bandwidth_hz, 2000);
}

TEST_F(BlowGathererTest, OfATouchThePartThatIsABlowStrikesAndTheRestIsAForce) {
  auto pushed = Touch(0, 1);  // from flight
  EXPECT_EQ(ImpulseOf(pushed[0]), 1);
  for (int i = 1; i < 20; ++i) pushed = Touch(i * kStepS, 0.1);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_FLOAT_EQ(ForceOf(pushed[0]).value_or(0), 10);  // 0.1 N s in 0.01 s
  pushed = Touch(20 * kStepS, 3);
  ASSERT_EQ(pushed.size(), 2U);
  EXPECT_FLOAT_EQ(ForceOf(pushed[0]).value_or(0), 30);
  pushed = Touch(21 * kStepS, 0.1);  // the blow is over
  ASSERT_EQ(pushed.size(), 3U);
  EXPECT_FLOAT_EQ(ImpulseOf(pushed[0]).value_or(0), 2.7F);
  EXPECT_GE(pushed[0].time_s, 21 * kStepS);  // the load lasts, so the blow is within a step
  EXPECT_LT(pushed[0].time_s, 22 * kStepS);
  EXPECT_EQ(gatherer_.counts().blow_count, 2U);
  EXPECT_EQ(gatherer_.counts().load_count, 20U);
}

TEST_F(BlowGathererTest, AnotherPartnerIsAnotherPair) {
  for (int i = 0; i < 20; ++i) Touch(i * kStepS, 10);
  const auto pushed = Step(20 * kStepS, [&] {
    TouchBy(gatherer_, 10);
    TouchBy(gatherer_, 10, 10);
  });
  EXPECT_FALSE(ImpulseOf(pushed[0]));
  EXPECT_TRUE(ImpulseOf(Nothing(21 * kStepS)[0]));
}

TEST_F(BlowGathererTest, ABlowThatIsNotOverIsSentAtTheEnd) {
  Nothing(0);
  Touch(kStepS, 10);
  const auto last = gatherer_.Finish();
  ASSERT_EQ(last.size(), 1U);
  EXPECT_EQ(ImpulseOf(last[0]), 10);
  EXPECT_TRUE(gatherer_.Finish().empty());
}

/// The times, in steps, at which a body strikes that hops `hop_count` times, each time after three
/// steps of flight. Each contact has the time offset.
std::vector<double> HopTimes(int hop_count, double time_offset_s, uint32_t partner = 1) {
  std::vector<double> times;
  const auto touch = [&](auto& gatherer, int step) {
    if (step % 4 != 2) return;
    gatherer.Touch({.contact = {.handle = 3}, .partner = partner, .time_offset_s = time_offset_s},
                   ImpulseOn(3, AlongZ(10)));
  };
  for (const ForceEvent& blow : BlowsOf(4 * hop_count, touch))
    times.push_back(blow.time_s / kStepS);
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

TEST_F(BlowGathererTest, BlowsAfterAFlightOfATenthOfASecondHaveExactTimes) {
  for (int step = 0; step < 240; ++step) {
    const auto pushed = step % 12 == 0 ? Touch(step * kStepS, 10) : Nothing(step * kStepS);
    for (const ForceEvent& event : pushed) {
      if (step > 0 && ImpulseOf(event)) {
        EXPECT_EQ(event.time_s, step * kStepS);
      }
    }
  }
  EXPECT_EQ(gatherer_.counts().blow_count, 20U);
}

/// The blows of a body that falls on another with an impulse of 1 N s, of which an engine with soft
/// contacts reports half a sine of `length_s` that begins `phase` steps before a step, and that
/// then rests with 1 N.
std::vector<ForceEvent> Fall(double rate_hz, double length_s, double phase) {
  const auto until = [&](double time_s) {  // the part of the impulse up to that time
    return (1 - std::cos(std::numbers::pi * std::clamp(time_s / length_s, 0.0, 1.0))) / 2;
  };
  const auto touch = [&](auto& gatherer, int step) {
    const double begin_s = (step - 10 + phase) / rate_hz, end_s = begin_s + 1 / rate_hz;
    if (end_s <= 0) return;
    const double rests = end_s > length_s ? 1 / rate_hz : 0;
    SurfaceImpulse impulse = AlongZ(until(end_s) - until(begin_s) + rests);
    impulse.pulse = Pulse::RaisedCosine(static_cast<float>(
        1e-4 * std::pow(double{impulse.impulse_newton_seconds[2]}, kDurationPower)));
    BodyImpulses impulses = ImpulseOn(3, impulse);
    impulses.duration_follows_impulse = true;
    gatherer.Touch({.contact = {.handle = 3}}, impulses);
  };
  return BlowsOf(static_cast<int>(0.5 * rate_hz), touch, 1 / rate_hz);
}

TEST(BlowGatherer, AFallIsOneBlowOfItsImpulseAndLengthAtEveryStepOfTheEngine) {
  for (const double rate_hz : {60.0, 240.0, 1000.0}) {
    for (const double length_s : {0.002, 0.008, 0.02, 0.03}) {
      for (const double phase : {0.0, 0.3, 0.7}) {
        double sum = 0, largest = 0, duration_s = 0;
        for (const ForceEvent& blow : Fall(rate_hz, length_s, phase)) {
          sum += *ImpulseOf(blow);
          if (*ImpulseOf(blow) < largest) continue;
          largest = *ImpulseOf(blow);
          duration_s = DurationS(blow);
        }
        // Nearly all of it is one blow; the first step of the load may count for it.
        EXPECT_NEAR(20 * std::log10(largest), 0, 1) << rate_hz << " Hz, " << length_s << " s";
        EXPECT_LT(sum - largest, 0.1);
        EXPECT_NEAR(duration_s, 1e-4, 1e-5);
      }
    }
  }
}

/// An impulse at a vertex, whose duration of 1 ms is that of a collision of 1 kg at J/(2 m).
BodyImpulses Landing(double newton_seconds, uint32_t vertex = 0) {
  SurfaceImpulse impulse = AlongZ(newton_seconds, vertex);
  impulse.pulse = Pulse::RaisedCosine(1e-3F);
  BodyImpulses impulses = ImpulseOn(3, impulse);
  impulses.by[0].collision.reduced_mass_kg = 1;
  impulses.duration_follows_impulse = true;
  return impulses;
}

/// The blows of a body of 1 kg that lands with 4 N s at once on `vertices`.
std::vector<ForceEvent> LandOn(const std::vector<uint32_t>& vertices) {
  return BlowsOf(100, [&](auto& gatherer, int step) {
    if (step != 99) return;
    for (const uint32_t vertex : vertices) {
      gatherer.Touch({.contact = {.handle = 3}},
                     Landing(4 / static_cast<double>(vertices.size()), vertex));
    }
  });
}

TEST(BlowGatherer, CornersThatLandTogetherShareTheMassAndHaveOneSpeed) {
  const std::vector<ForceEvent> blows = LandOn({0, 1, 2, 3});
  ASSERT_EQ(blows.size(), 4U);
  for (const ForceEvent& blow : blows) {
    // T = 2.87 (m^2/(R E^2 v))^(1/5): a quarter of the mass, and four times the speed J/(2 m).
    EXPECT_NEAR(DurationS(blow), 1e-3 * std::pow(1.0 / 16 / 4, 0.2), 1e-9);
    EXPECT_DOUBLE_EQ(blow.collision.reduced_mass_kg, 0.25);
  }
  // At one place they are one contact. An engine may report that of a corner once for each triangle
  // of the floor.
  const std::vector<ForceEvent> at_one_place = LandOn({1, 1});
  ASSERT_EQ(at_one_place.size(), 2U);
  for (const ForceEvent& blow : at_one_place) {
    EXPECT_NEAR(DurationS(blow), 1e-3 * std::pow(1.0 / 2, 0.2), 1e-9);
  }
  EXPECT_NEAR(DurationS(LandOn({1}).at(0)), 1e-3, 1e-9);
}

/// An impulse of `newton_seconds` on a body of 1 kg that is 0.5 m long, `along_m` from its end.
BodyImpulses At(double along_m, double newton_seconds) {
  BodyImpulses impulses = Landing(newton_seconds, static_cast<uint32_t>(100 * along_m));
  impulses.by[0].point_m = {along_m, 0, 0};
  impulses.by[0].extent_m = 0.5;
  return impulses;
}

uint32_t VertexOf(const ForceEvent& blow) {
  return std::get<SurfaceImpulse>(blow.action).at.vertices[1];
}

TEST(BlowGatherer, ASecondBlowAtAPlaceSoundsInFullOnceTheBodiesHaveParted) {
  for (const double rate_hz : {60.0, 240.0, 1000.0}) {
    for (const int apart : {2, 3, 5}) {
      const std::vector<ForceEvent> blows = BlowsOf(
          60,
          [&](auto& gatherer, int step) {
            if (step == 40) gatherer.Touch({.contact = {.handle = 3}}, At(0, 10));
            if (step == 40 + apart) gatherer.Touch({.contact = {.handle = 3}}, At(0, 6));
          },
          1 / rate_hz);
      SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << apart);
      ASSERT_EQ(blows.size(), 2U);
      EXPECT_NEAR(*ImpulseOf(blows[0]), 10, 1e-5);
      EXPECT_NEAR(*ImpulseOf(blows[1]), 6, 1e-5);
    }
  }
}

TEST(BlowGatherer, CornersThatLandInDifferentStepsStrikeOneByOne) {
  for (const double rate_hz : {60.0, 240.0, 1000.0, 2400.0}) {
    for (const double second : {2.0, 7.0, 14.0}) {
      for (int apart = 1; apart <= 9; ++apart) {
        const std::vector<ForceEvent> blows = BlowsOf(
            60,
            [&](auto& gatherer, int step) {
              if (step == 40) gatherer.Touch({.contact = {.handle = 3}}, At(0, 10));
              if (step == 40 + apart) gatherer.Touch({.contact = {.handle = 3}}, At(0.4, second));
            },
            1 / rate_hz);
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << second << ", " << apart);
        ASSERT_EQ(blows.size(), 2U);
        EXPECT_EQ(VertexOf(blows[0]), 0U);
        EXPECT_EQ(VertexOf(blows[1]), 40U);
        EXPECT_NEAR(*ImpulseOf(blows[0]), 10, 1e-5);
        EXPECT_NEAR(*ImpulseOf(blows[1]), second, 1e-5);
        const double later_s = blows[1].time_s - blows[0].time_s;
        EXPECT_NEAR(later_s, apart / rate_hz, 1e-9);
      }
    }
  }
}

/// The integral of a soft blow of 8 ms up to a time since it began, over its impulse.
double PartOfHalfSine(double time_s) {
  constexpr double kLastsS = 0.008;
  return (1 - std::cos(std::numbers::pi * std::clamp(time_s / kLastsS, 0.0, 1.0))) / 2;
}

TEST(BlowGatherer, ARockingBodyStrikesWithTheWholeImpulseOfEachSoftContact) {
  const std::vector<double> newton_seconds{0.6, 0.7, 0.3};
  for (const double rate_hz : {240.0, 480.0, 1000.0}) {
    for (const double rocks_s : {0.02, 0.03}) {
      const std::vector<ForceEvent> blows = BlowsOf(
          static_cast<int>(0.4 * rate_hz),
          [&](auto& gatherer, int step) {
            for (size_t blow = 0; blow < newton_seconds.size(); ++blow) {
              const double time_s = step / rate_hz - 0.1 - static_cast<double>(blow) * rocks_s;
              const double part = PartOfHalfSine(time_s) - PartOfHalfSine(time_s - 1 / rate_hz);
              if (part < 1e-9) continue;
              gatherer.Touch({.contact = {.handle = 3}},
                             At(blow == 1 ? 0.4 : 0, part * newton_seconds[blow]));
            }
          },
          1 / rate_hz);
      SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << rocks_s << " s");
      ASSERT_EQ(blows.size(), 3U);
      for (size_t blow = 0; blow < blows.size(); ++blow) {
        EXPECT_EQ(VertexOf(blows[blow]), blow == 1 ? 40U : 0U);
        EXPECT_NEAR(*ImpulseOf(blows[blow]) / newton_seconds[blow], 1, 0.2);
      }
    }
  }
}

TEST(BlowGatherer, OfCornersWhoseSoftContactsOverlapEachGetsItsOwnImpulse) {
  const std::vector<double> half_sine{0.2, 0.5, 0.6, 0.5, 0.2};
  const std::vector<ForceEvent> blows = BlowsOf(
      60,
      [&](auto& gatherer, int step) {
        for (const auto& [along_m, begin] : {std::pair(0.0, 20), {0.4, 23}}) {
          if (step < begin || step >= begin + 5) continue;
          const double newton_seconds = half_sine[static_cast<size_t>(step - begin)];
          gatherer.Touch({.contact = {.handle = 3}}, At(along_m, newton_seconds));
        }
      },
      0.001);
  ASSERT_EQ(blows.size(), 2U);
  EXPECT_EQ(VertexOf(blows[1]), 40U);
  for (const ForceEvent& blow : blows) EXPECT_NEAR(*ImpulseOf(blow), 2, 0.21);
  EXPECT_NEAR(blows[1].time_s - blows[0].time_s, 0.003, 1e-9);
}

TEST(BlowGatherer, ACornerThatSlidesDuringABlowStrikesOnce) {
  const std::vector<ForceEvent> blows = BlowsOf(40, [](auto& gatherer, int step) {
    if (step < 20 || step >= 28) return;
    gatherer.Touch({.contact = {.handle = 3}}, At(0.05 * (step - 20), 0.25));
  });
  ASSERT_EQ(blows.size(), 1U);
  EXPECT_NEAR(*ImpulseOf(blows[0]), 2, 1e-6);
}

TEST(BlowGatherer, ACornerThatSlidesFastOverAnotherBodyStrikesOnceAndOneThatRocksOnItTwice) {
  const auto land = [](double on_die_m, double on_table_m) {
    return BlowsOf(40, [=](auto& gatherer, int step) {
      if (step != 20 && step != 21) return;
      BodyImpulses impulses = At(step == 20 ? 0.0 : on_table_m, 1);
      impulses.by[1] = impulses.by[0];
      impulses.by[1].handle = 4;
      impulses.by[1].extent_m = 0.02;
      impulses.by[1].point_m = {step == 20 ? 0.0 : on_die_m, 0, 0};
      impulses.count = 2;
      gatherer.Touch({.contact = {.handle = 3}, .partner = 4}, impulses);
    });
  };
  EXPECT_EQ(land(0.001, 0.3).size(), 2U);  // each strikes both bodies
  EXPECT_EQ(land(0.015, 0.015).size(), 4U);
}

TEST(BlowGatherer, AStrongBlowSoonAfterABodyWasLaidDownHasItsOwnImpulse) {
  for (const double rate_hz : {60.0, 240.0, 1000.0, 2400.0}) {
    const double weight = 9.81 / rate_hz;  // the impulse of 1 kg in a step
    for (const int laid : {0, 30}) {       // in the first step, or after a flight
      for (const double at_s : {0.02, 0.04, 0.08, 0.15}) {
        const int struck = laid + static_cast<int>(std::ceil(at_s * rate_hz)) + 1;
        const std::vector<ForceEvent> blows = BlowsOf(
            struck + 400,
            [&](auto& gatherer, int step) {
              if (step < laid) return;
              const double weights = step == struck ? 60 : 1;
              gatherer.Touch({.contact = {.handle = 3}}, At(0, weights * weight));
            },
            1 / rate_hz);
        double sum = 0, largest = 0;
        for (const ForceEvent& blow : blows) {
          sum += *ImpulseOf(blow) / weight;
          largest = std::max(largest, *ImpulseOf(blow) / weight);
        }
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << laid << ", " << at_s);
        EXPECT_NEAR(largest, 58, 2.1);  // up to three times the usual force is a load's jitter
        EXPECT_LT(sum - largest, 1.1);
      }
    }
  }
}

TEST(BlowGatherer, TheNoiseOfALoadThatWasJustLaidDownDoesNotStrike) {
  for (const double rate_hz : {240.0, 1000.0}) {
    for (unsigned seed = 1; seed <= 6; ++seed) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> noise(0.4, 1.6);
      const double weight = 9.81 / rate_hz;
      const double struck = StruckBy(
          1000, [&](auto& gatherer, int) { TouchBy(gatherer, noise(random) * weight); },
          1 / rate_hz);
      EXPECT_EQ(struck, 0) << rate_hz << " Hz, " << seed;
    }
  }
}

TEST(BlowGatherer, ABlowThatEndsInAGreaterLoadIsNotLost) {
  for (const double rate_hz : {60.0, 240.0, 1000.0, 2400.0}) {
    const double weight = 9.81 / rate_hz;
    const double struck = StruckBy(
        600,
        [&](auto& gatherer, int step) {
          const double weights = step < 5 ? 1 : step == 5 ? 700 : step == 6 ? 200 : 50;
          gatherer.Touch({.contact = {.handle = 3}}, At(0, weights * weight));
        },
        1 / rate_hz);
    EXPECT_NEAR(struck / weight, 894, 1) << rate_hz;
  }
}

TEST(BlowGatherer, CornersWhoseImpulsesAreGreatestInNeighbouringStepsLandTogether) {
  const std::vector<ForceEvent> blows = BlowsOf(40, [](auto& gatherer, int step) {
    if (step != 20 && step != 21) return;
    gatherer.Touch({.contact = {.handle = 3}}, At(0, step == 20 ? 0.6 : 0.4));
    gatherer.Touch({.contact = {.handle = 3}}, At(0.4, step == 20 ? 0.4 : 0.6));
  });
  ASSERT_EQ(blows.size(), 2U);
  EXPECT_EQ(blows[0].time_s, blows[1].time_s);
  for (const ForceEvent& blow : blows) {
    EXPECT_NEAR(*ImpulseOf(blow), 1, 1e-6);
    EXPECT_DOUBLE_EQ(blow.collision.reduced_mass_kg, 0.5);
  }
}

/// The speed that a body of half implicit steps has in the step in which it meets the floor, m/s.
constexpr double kFallMPerS = 9.81 * kStepS * 20;

/// Lets a body of 1 kg fall for 19 steps, with a pose in each, and land in the next one with
/// `impulses`. Returns its blows.
std::vector<ForceEvent> Fall(const std::vector<BodyImpulses>& impulses, double leap_m = 0) {
  double height_m = 1;
  return BlowsOf(21, [&](auto& gatherer, int step) {
    if (step == 0) return;
    if (step < 20) height_m -= 9.81 * kStepS * kStepS * step;
    gatherer.Move(3, 1, {.position_m = {0, 0, step < 19 ? height_m + leap_m : height_m}});
    if (step < 20) return;
    for (const BodyImpulses& impulse : impulses) {
      gatherer.Touch({.contact = {.handle = 3}}, impulse);
    }
  });
}

/// The duration after Hertz of a collision of 1 kg that takes 1 ms at another speed, s.
double AtSpeed(double m_per_s, double one_ms_at_m_per_s) {
  return 1e-3 * std::pow(m_per_s / one_ms_at_m_per_s, -0.2);
}

TEST(BlowGatherer, ABlowHasTheSpeedOfThePosesWhateverTheRestitution) {
  for (const double restitution : {0.0, 0.5, 0.9}) {
    const double impulse = (1 + restitution) * kFallMPerS;
    const std::vector<ForceEvent> blows = Fall({Landing(impulse)});
    ASSERT_EQ(blows.size(), 1U);
    EXPECT_NEAR(DurationS(blows[0]), AtSpeed(kFallMPerS, impulse / 2), 1e-9) << restitution;
    EXPECT_NEAR(blows[0].collision.stated_speed_m_per_s, kFallMPerS, 1e-9) << restitution;
  }
}

TEST(BlowGatherer, ABlowWithFrictionHasTheSpeedAlongTheNormal) {
  SurfaceImpulse oblique = AlongZ(kFallMPerS);
  oblique.impulse_newton_seconds[0] = static_cast<float>(0.6 * kFallMPerS);
  oblique.pulse = Pulse::RaisedCosine(1e-3F);
  BodyImpulses impulses = Landing(kFallMPerS);
  impulses.by[0].event.action = oblique;
  const ForceEvent blow = Fall({impulses}).at(0), straight = Fall({Landing(kFallMPerS)}).at(0);
  EXPECT_NEAR(blow.collision.stated_speed_m_per_s, kFallMPerS, 1e-9);
  EXPECT_NEAR(blow.collision.reduced_mass_kg, 1, 1e-9);
  EXPECT_NEAR(DurationS(blow), DurationS(straight), 1e-9);
}

TEST(BlowGatherer, ASpeedThatTheImpulseContradictsDoesNotCount) {
  const std::pair<double, double> contradictions[] = {
      {kFallMPerS, 20},        // it was put elsewhere just before
      {4 * kFallMPerS, 0},     // it was struck by what moves
      {0.2 * kFallMPerS, 0}};  // it only grazed the floor
  for (const auto& [impulse, leap_m] : contradictions) {
    const std::vector<ForceEvent> blows = Fall({Landing(impulse)}, leap_m);
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
  EXPECT_EQ(Fall({of_mass}).at(0).collision.reduced_mass_kg, 1);
  const ForceEvent blow = Fall({of_speed}).at(0);
  EXPECT_NEAR(DurationS(blow), 1e-3, 1e-9);
  EXPECT_EQ(blow.collision.stated_speed_m_per_s, 7);
}

TEST(BlowGatherer, ACornerBringsLessMassToRestThanAFaceWhoseTurnsCancel) {
  BodyImpulses left = Landing(kFallMPerS / 2, 0), right = Landing(kFallMPerS / 2, 1);
  left.by[0].turn[1] = kFallMPerS;
  right.by[0].turn[1] = -kFallMPerS;
  left.by[0].collision.reduced_mass_kg = right.by[0].collision.reduced_mass_kg = 0.2;
  const std::vector<ForceEvent> face = Fall({left, right});
  ASSERT_EQ(face.size(), 2U);
  for (const ForceEvent& blow : face) EXPECT_NEAR(blow.collision.reduced_mass_kg, 0.5, 1e-6);
  // 1/m = 1/M + turn^2/J^2 = 1 + 4
  EXPECT_NEAR(Fall({left}).at(0).collision.reduced_mass_kg, 0.2, 1e-6);
}

TEST(BlowGatherer, ABodyThatFallsOnAnUnknownOneMeetsAFloorAndNotAHammer) {
  BodyImpulses impulse = Landing(1.5 * kFallMPerS);
  impulse.striker_per_kg = std::nullopt;
  impulse.by[0].collision.reduced_mass_kg = 0.02;
  const ForceEvent blow = Fall({impulse}).at(0);
  EXPECT_NEAR(blow.collision.reduced_mass_kg, 1, 1e-9);
  EXPECT_NEAR(DurationS(blow), AtSpeed(kFallMPerS, 1.5 * kFallMPerS / 0.04) * std::pow(50, 0.4),
              1e-9);
  // What strikes a body is a hammer.
  impulse = Landing(0.1 * kFallMPerS);
  impulse.striker_per_kg = std::nullopt;
  impulse.by[0].collision.reduced_mass_kg = 0.02;
  EXPECT_NEAR(Fall({impulse}).at(0).collision.reduced_mass_kg, 0.02, 1e-9);
}

TEST(BlowGatherer, ABodyThatIsPutDownGentlyDoesNotStrike) {
  for (const double rate_hz : {240.0, 1000.0}) {
    const auto touch = [rate_hz](auto& gatherer, int step) {
      const double newtons = std::clamp((step - 10) / rate_hz / 0.02, 0.0, 1.0);
      if (newtons > 0) TouchBy(gatherer, newtons / rate_hz);
    };
    // In newton seconds; the first step alone would be 0.004.
    EXPECT_LT(StruckBy(static_cast<int>(0.3 * rate_hz), touch, 1 / rate_hz), 1e-3) << rate_hz;
  }
}

/// The impulses of 1 N s that an engine reports in equal parts, or as half a sine, in `step_count`
/// steps. Returns those of the blows.
std::vector<float> BlowsOfSpread(double rate_hz, int step_count, bool half_sine) {
  std::vector<double> parts(static_cast<size_t>(step_count), 1);
  if (half_sine) {
    for (size_t i = 0; i < parts.size(); ++i) {
      parts[i] = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / step_count);
    }
  }
  const double whole = std::accumulate(parts.begin(), parts.end(), 0.0);
  const auto touch = [&](auto& gatherer, int step) {
    if (step < 10 || step - 10 >= step_count) return;
    TouchBy(gatherer, parts[static_cast<size_t>(step) - 10] / whole);
  };
  std::vector<float> blows;
  for (const ForceEvent& blow : BlowsOf(2 * step_count + 20, touch, 1 / rate_hz)) {
    blows.push_back(*ImpulseOf(blow));
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
      gatherer.Touch({.contact = {.handle = 3}, .roughness = roughness}, ImpulseOn(3, AlongZ(10)));
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
