// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/remaining_time.h"

#include <gtest/gtest.h>

#include "precompute/program/work_clock.h"

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

/// A process whose main thread works, and gets `share` of a processor.
struct Process {
  WorkClock::Times now{};
  WorkClock clock{now};

  void Run(double seconds, double share) {
    for (int tick = 0; tick < 10 * seconds; ++tick) {
      now.seconds += 0.1;
      now.waited_s += 0.1 * (1 - share);
      clock.Advance(now);
    }
  }
};

TEST(WorkClock, IsTheWallClockOfAProcessThatNobodyHinders) {
  Process process;
  process.Run(15, 1);
  EXPECT_NEAR(process.clock.seconds(), 15, 1e-9);
  EXPECT_NEAR(process.clock.Slowdown(), 1, 1e-9);
}

TEST(WorkClock, FollowsTheShareOfAProcessor) {
  Process process;
  process.Run(60, 0.05);
  EXPECT_NEAR(process.clock.seconds(), 3, 1e-9);
  // The 0.1 s taken on trust are a sixth of the work that the clock remembers.
  EXPECT_NEAR(process.clock.Slowdown(), 20, 0.2 * 20);
  process.Run(60, 1);
  EXPECT_NEAR(process.clock.Slowdown(), 1, 0.01);
}

TEST(WorkClock, TellsHowLongAWorkerThatStarvesWillTake) {
  Process process;
  RemainingTime remaining;
  remaining.BeginRound(0, {});
  remaining.Plan(0, {{v1::PHASE_RADIATE, 20}});
  remaining.Progress(0, v1::PHASE_RADIATE, 0);
  process.Run(60, 0.05);
  const double left_s =
      remaining.Seconds(process.clock.seconds()).value() * process.clock.Slowdown();
  EXPECT_NEAR(left_s, 340, 0.2 * 340);
}

}  // namespace
}  // namespace carillon::precompute
