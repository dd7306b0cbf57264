// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/work_clock.h"

#include <gtest/gtest.h>

#include "precompute/program/remaining_time.h"

namespace carillon::precompute {
namespace {

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
