// SPDX-License-Identifier: Apache-2.0
#include "server/scene/momentum_balance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

namespace carillon {
namespace {

constexpr double kMassKg = 0.942;
constexpr double kGravityMPerS2 = 9.81;

/// A step of the simulation, as an engine may report it.
struct Told {
  Vector3 position{};
  Quaternion orientation{};
  std::vector<Vector3> impulses{};  // in the scene's frame
  bool empty = false;               // a contact without an impulse
};

/// A body that turns, falls onto a floor again and again, each time from 0.8 m or more, and rests
/// for half a second, or that is thrown up again at once. Substeps of symplectic Euler, as in the
/// engines.
class Falls {
 public:
  explicit Falls(double rate_hz, int substeps = 1, double restitution = 0)
      : step_s_(1 / rate_hz), substeps_(substeps), restitution_(restitution) {}

  std::vector<Told> Steps(double duration_s) {
    std::vector<Told> steps;
    const double h = step_s_ / substeps_;
    double since_rest_s = 0;
    for (double time_s = 0; time_s < duration_s; time_s += step_s_) {
      Told told;
      Vector3 sum{};
      for (int i = 0; i < substeps_; ++i) {
        velocity_[2] -= kGravityMPerS2 * h;
        Vector3 impulse{};
        if (position_[2] + h * velocity_[2] < 0) {
          // Without a bounce the body keeps the speed that closes the gap, as in many engines.
          const double after = velocity_[2] < -0.5 && restitution_ > 0
                                   ? -restitution_ * velocity_[2]
                                   : -position_[2] / h;
          impulse = {-0.2 * kMassKg * velocity_[0], 0, kMassKg * (after - velocity_[2])};
          velocity_ = {0.8 * velocity_[0], 0, after};
        }
        for (size_t axis = 0; axis < 3; ++axis) {
          sum[axis] += impulse[axis];
          position_[axis] += h * velocity_[axis];
        }
        last_ = impulse;
      }
      lasts.push_back(last_);
      angle_ += 3 * step_s_;
      told.position = position_;
      told.orientation = {std::cos(angle_ / 2), 0, std::sin(angle_ / 2), 0};
      if (sum != Vector3{}) told.impulses.push_back(sum);
      steps.push_back(told);
      since_rest_s = std::abs(velocity_[2]) < 1e-9 ? since_rest_s + step_s_ : 0;
      if (since_rest_s > 0.5) {                      // a hand lifts the body
        position_[2] = 0.8 + 0.013 * ++lift_count_;  // each blow is in another place of its step
        since_rest_s = 0;
      }
    }
    return steps;
  }

  std::vector<Vector3> lasts;  // the impulse of each step's last substep

 private:
  const double step_s_;
  const int substeps_;
  const double restitution_;
  Vector3 position_{0, 0, 0.8}, velocity_{0.7, 0, 0}, last_{};
  double angle_ = 0;
  int lift_count_ = 0;
};

MomentumBalance::Report ReportOf(uint32_t handle, const Vector3& impulse, uint32_t vertex = 0,
                                 MomentumBalance::Role role = MomentumBalance::Role::kOnly) {
  return {.handle = handle,
          .mass_kg = kMassKg,
          .impulse_newton_seconds = {static_cast<float>(impulse[0]), static_cast<float>(impulse[1]),
                                     static_cast<float>(impulse[2])},
          .vertices = {vertex, 0, 0},
          .weights = {1, 0, 0},
          .role = role};
}

EngineMistakes Mistakes(const std::vector<Told>& steps, double rate_hz, double mass_kg = kMassKg,
                        bool wrong_frame = false) {
  MomentumBalance balance(1 / rate_hz, false);
  for (size_t k = 0; k < steps.size(); ++k) {
    const Told& told = steps[k];
    balance.Move(1, told.position, told.orientation);
    for (const Vector3& impulse : told.impulses) {
      MomentumBalance::Report report =
          ReportOf(1, wrong_frame ? impulse : Rotated(impulse, Inverse(told.orientation)));
      report.mass_kg = mass_kg;
      balance.Touch(report);
    }
    if (told.empty) balance.TouchWithout(1);
    balance.EndStep(static_cast<double>(k) / rate_hz);
  }
  return balance.mistakes();
}

/// The mistakes that are told, with their ratios.
std::map<EngineMistake, double> Named(const EngineMistakes& mistakes) {
  std::map<EngineMistake, double> named;
  for (size_t i = 0; i < mistakes.size(); ++i) {
    if (mistakes[i].count > 0) named[static_cast<EngineMistake>(i)] = mistakes[i].ratio;
  }
  return named;
}

/// The same of these steps.
std::map<EngineMistake, double> Named(const std::vector<Told>& steps, double rate_hz) {
  return Named(Mistakes(steps, rate_hz));
}

using enum EngineMistake;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Key;

constexpr double kRates[] = {60, 144, 240, 1000};

TEST(MomentumBalance, ARightSimulationHasNoMistake) {
  for (const double rate_hz : kRates) {
    for (const int substeps : {1, 4}) {
      for (const double restitution : {0.0, 0.6}) {
        std::vector<Told> steps = Falls(rate_hz, substeps, restitution).Steps(8);
        EXPECT_THAT(Named(steps, rate_hz), IsEmpty()) << rate_hz;
        // The same with the poses before the step.
        for (size_t k = steps.size() - 1; k > 0; --k) {
          steps[k].position = steps[k - 1].position;
          steps[k].orientation = steps[k - 1].orientation;
        }
        EXPECT_THAT(Named(steps, rate_hz), IsEmpty()) << rate_hz;
      }
    }
  }
}

TEST(MomentumBalance, NamesARatioAndItsSize) {
  for (const double rate_hz : kRates) {
    const std::vector<Told> right = Falls(rate_hz).Steps(8);
    const auto scaled = [&](double by) {
      std::vector<Told> steps = right;
      for (Told& told : steps) {
        for (Vector3& impulse : told.impulses) impulse = {by * impulse[0], 0, by * impulse[2]};
      }
      return Named(steps, rate_hz);
    };
    const auto only = [](EngineMistake mistake, double ratio) {
      return ElementsAre(testing::Pair(mistake, testing::DoubleNear(ratio, 0.1 * std::abs(ratio))));
    };
    EXPECT_THAT(scaled(rate_hz), only(kForces, rate_hz));
    EXPECT_THAT(scaled(2), only(kTwice, 2));
    EXPECT_THAT(scaled(6.3), only(kOtherMass, 6.3));
    EXPECT_THAT(scaled(-1), ElementsAre(Key(kReversed))) << rate_hz;
    EXPECT_THAT(Named(Mistakes(right, rate_hz, kMassKg / 1.6)), only(kOtherMass, 1.6));
  }
}

TEST(MomentumBalance, NamesTheFrameTheDelayAndTheFirstStep) {
  for (const double rate_hz : kRates) {
    const std::vector<Told> right = Falls(rate_hz).Steps(40);
    EXPECT_THAT(Named(Mistakes(right, rate_hz, kMassKg, true)), ElementsAre(Key(kOtherFrame)))
        << rate_hz;
    std::vector<Told> late = right, first = right;
    for (size_t k = right.size() - 1; k > 0; --k) late[k].impulses = right[k - 1].impulses;
    late[0].impulses.clear();
    EXPECT_THAT(Named(late, rate_hz), ElementsAre(Key(kLate))) << rate_hz;
    for (size_t k = 1; k < right.size(); ++k) {
      if (!right[k - 1].impulses.empty() || right[k].impulses.empty()) continue;
      first[k].impulses.clear();
      first[k].empty = true;
    }
    EXPECT_THAT(Named(first, rate_hz), ElementsAre(Key(kFirstZero))) << rate_hz;
  }
}

TEST(MomentumBalance, NamesTheLastSubstep) {
  for (const double rate_hz : {60.0, 240.0}) {
    for (const int substeps : {2, 4, 10}) {
      Falls falls(rate_hz, substeps);
      std::vector<Told> steps = falls.Steps(12);
      for (size_t k = 0; k < steps.size(); ++k) {
        steps[k].empty = !steps[k].impulses.empty();
        steps[k].impulses.clear();
        if (falls.lasts[k] != Vector3{}) steps[k].impulses.push_back(falls.lasts[k]);
      }
      const auto named = Named(steps, rate_hz);
      ASSERT_TRUE(named.contains(kLastSubstep)) << rate_hz << " " << substeps;
      EXPECT_NEAR(named.at(kLastSubstep), 1.0 / substeps, 0.05 / substeps);
    }
  }
}

TEST(MomentumBalance, NamesAnImpulseThatStaysWhenTheBodyIsGone) {
  for (const double rate_hz : kRates) {
    const double weight = kMassKg * kGravityMPerS2 / rate_hz;
    std::vector<Told> thrown, falls;
    for (int k = 0; k < static_cast<int>(rate_hz); ++k) {
      const double away_s = std::max(0.0, k / rate_hz - 0.5);
      thrown.push_back({.position = {0, 0, 2 * away_s}, .impulses = {{0, 0, weight}}});
      falls.push_back({.position = {0, 0, -kGravityMPerS2 * away_s * away_s / 2},
                       .impulses = {{0, 0, weight}}});
    }
    for (const auto& steps : {thrown, falls}) {
      const EngineMistakes mistakes = Mistakes(steps, rate_hz);
      EXPECT_THAT(Named(mistakes), ElementsAre(Key(kStale))) << rate_hz;
      EXPECT_NEAR(static_cast<double>(mistakes[2].count), 0.5 * rate_hz, 3);
    }
  }
}

TEST(MomentumBalance, ALiftOrAHandThatCarriesABodyIsNoMistake) {
  constexpr double kRateHz = 240;
  const double weight = kMassKg * kGravityMPerS2 / kRateHz;
  std::vector<Told> lift, hand;
  double height = 0, speed = 0;
  for (int k = 0; k < 480; ++k) {
    const double gains = k > 100 && k < 220 ? 0.01 : 0;  // to 1.2 m/s
    speed += gains;
    height += speed / kRateHz;
    lift.push_back({.position = {0, 0, height}, .impulses = {{0, 0, weight + kMassKg * gains}}});
    hand.push_back({.position = {k % 40 == 0 ? 0.1 : 0, 0, 0}});
  }
  EXPECT_THAT(Named(lift, kRateHz), IsEmpty());
  EXPECT_THAT(Named(hand, kRateHz), IsEmpty());
}

TEST(MomentumBalance, ALinkThatAMotorPressesOnATableIsNoMistake) {
  constexpr double kRateHz = 240;
  for (double pressed = 0.05; pressed < 0.6; pressed += 0.0125) {
    std::vector<Told> steps;
    for (int k = 1; k < 600; ++k) {
      const double up_m = 0.05 * std::max(0.0, std::sin(4 * std::numbers::pi * k / kRateHz));
      Told told{.position = {0.1 * std::sin(2 * std::numbers::pi * k / kRateHz), 0, up_m}};
      if (up_m == 0) told.impulses = {{0, 0, pressed * kMassKg * kGravityMPerS2 / kRateHz}};
      steps.push_back(told);
    }
    EXPECT_THAT(Named(steps, kRateHz), IsEmpty()) << pressed;
  }
}

TEST(MomentumBalance, WithoutPosesItNamesForcesAndEqualContacts) {
  for (const double rate_hz : kRates) {
    const auto rests = [&](double impulse, int times) {
      MomentumBalance balance(1 / rate_hz, false);
      for (int k = 0; k < 240; ++k) {
        for (uint32_t corner = 0; corner < 4; ++corner) {
          for (int i = 0; i < times; ++i) {
            balance.Touch(ReportOf(1, {0, 0, impulse / 4}, corner));
          }
        }
        balance.EndStep(k / rate_hz);
      }
      return Named(balance.mistakes());
    };
    const double weight = kMassKg * kGravityMPerS2;
    EXPECT_THAT(rests(weight / rate_hz, 1), IsEmpty());
    EXPECT_THAT(rests(3 * weight / rate_hz, 1), IsEmpty());
    EXPECT_THAT(rests(weight, 1), ElementsAre(Key(kForces)));
    EXPECT_THAT(rests(weight / rate_hz, 2), ElementsAre(Key(kTwice)));
  }
}

TEST(MomentumBalance, NamesContactsOfTwoObjectsFromBothSidesBesideRightOnesWithAFloor) {
  using enum MomentumBalance::Role;
  const auto balanced = [](bool mirrors) {
    MomentumBalance balance(1 / 240.0, false);
    for (int k = 0; k < 240; ++k) {
      for (uint32_t corner = 0; corner < 4; ++corner) {
        balance.Touch(ReportOf(1, {0, 0, 0.004 + 0.001 * corner}, corner));
      }
      if (k % 60 == 30) {
        balance.Touch(ReportOf(1, {0, 0, -0.3}, 7, kFirst));
        balance.Touch(ReportOf(2, {0, 0, 0.3}, 5, kSecond));
      }
      if (k % 60 == 30 && mirrors) {
        balance.Touch(ReportOf(2, {0, 0, 0.3}, 5, kFirst));
        balance.Touch(ReportOf(1, {0, 0, -0.3}, 7, kSecond));
      }
      balance.EndStep(k / 240.0);
    }
    return balance.mistakes()[static_cast<size_t>(kTwice)];
  };
  EXPECT_EQ(balanced(false).count, 0);
  EXPECT_EQ(balanced(true).count, 8);  // four, each twice
  EXPECT_EQ(balanced(true).ratio, 2);
}

}  // namespace
}  // namespace carillon
