// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/remaining_time.h"

#include <gtest/gtest.h>

namespace carillon::precompute {
namespace {

// As a body of some size: 10 s counting, 5 s factoring, 80 s solving, 5 s checking, 20 s coupling.
const std::vector<PlannedStep> kSteps = {{v1::PHASE_VERIFY, 10},
                                         {v1::PHASE_FACTOR, 5},
                                         {v1::PHASE_SOLVE, 80},
                                         {v1::PHASE_VERIFY, 5},
                                         {v1::PHASE_WRITE, 20}};

/// Goes through all steps on a machine that takes `slowness` seconds for a predicted one; calls
/// `look` with the time and the true remaining time at the end of each, before the next begins.
template <typename Look>
void RunAll(RemainingTime& remaining, double begun_s, double slowness, Look look) {
  double now_s = begun_s;
  double left_s = 120 * slowness;
  remaining.Plan(now_s, kSteps);
  for (const PlannedStep& step : kSteps) {
    remaining.Progress(now_s, step.phase, 0);
    now_s += slowness * step.predicted_s;
    left_s -= slowness * step.predicted_s;
    remaining.Progress(now_s, step.phase, 1);
    look(now_s, left_s);
  }
}

TEST(RemainingTime, IsThePlanWhereNothingHasBeenMeasured) {
  RemainingTime remaining;
  remaining.BeginRound(0, {});
  remaining.Plan(7, kSteps);
  EXPECT_DOUBLE_EQ(remaining.Seconds(7).value(), 120);
}

TEST(RemainingTime, FallsAndIsTrueAtEachPhasesEndWhateverTheMachinesSpeed) {
  for (const double slowness : {0.2, 1.0, 2.5, 7.0}) {
    RemainingTime remaining;
    remaining.BeginRound(0, {});
    double before = 1e9;
    RunAll(remaining, 3, slowness, [&](double now_s, double left_s) {
      const double seconds = remaining.Seconds(now_s).value();
      // 0.05 s of the 10 s of the first step are taken on trust.
      EXPECT_NEAR(seconds, left_s, 0.03 * left_s + 1e-9);
      EXPECT_LT(seconds, before);
      before = seconds;
    });
    EXPECT_DOUBLE_EQ(before, 0);
  }
}

TEST(RemainingTime, ANewPlanKeepsTheMeasuredSpeed) {
  RemainingTime remaining;
  remaining.BeginRound(0, {});
  remaining.Plan(0, kSteps);
  remaining.Progress(0, v1::PHASE_VERIFY, 0);
  remaining.Progress(20, v1::PHASE_VERIFY, 1);
  std::vector<PlannedStep> more = kSteps;
  more[2].predicted_s = 400;
  remaining.Plan(20, more);
  remaining.Progress(20, v1::PHASE_FACTOR, 0);
  EXPECT_NEAR(remaining.Seconds(20).value(), 2 * (5 + 400 + 5 + 20), 5);
}

}  // namespace
}  // namespace carillon::precompute
