// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/timetable.h"

#include <gtest/gtest.h>

#include <chrono>
#include <latch>

namespace carillon {
namespace {

using std::chrono::hours;

TEST(Timetable, WithoutTasksNothingIsDue) { EXPECT_FALSE(Timetable().RunDue().has_value()); }

TEST(Timetable, RunsEachTaskAtOnceAndThenWhenItsTimeIsOver) {
  int often = 0;
  int seldom = 0;
  Timetable timetable;
  timetable.Add([&often] {
    ++often;
    return Timetable::Clock::duration::zero();
  });
  timetable.Add([&seldom] {
    ++seldom;
    return hours(1);
  });
  for (int i = 0; i < 3; ++i) EXPECT_EQ(timetable.RunDue(), Timetable::Clock::duration::zero());
  EXPECT_EQ(often, 3);
  EXPECT_EQ(seldom, 1);
}

TEST(Timetable, TellsTheTimeUntilTheNextTask) {
  Timetable timetable;
  timetable.Add([] { return hours(2); });
  timetable.Add([] { return hours(1); });
  const auto time = timetable.RunDue();
  ASSERT_TRUE(time.has_value());
  EXPECT_LE(*time, hours(1));
  EXPECT_GT(*time, hours(1) - std::chrono::minutes(30));
}

TEST(Timetable, RunsItsTasksOnItsThreadUntilItStops) {
  std::latch ran_thrice(3);
  int count = 0;
  Timetable timetable;
  timetable.Add([&] {
    if (++count <= 3) ran_thrice.count_down();
    return std::chrono::milliseconds(1);
  });
  timetable.Start();
  ran_thrice.wait();
  timetable.Stop();
  EXPECT_GE(count, 3);
}

}  // namespace
}  // namespace carillon
