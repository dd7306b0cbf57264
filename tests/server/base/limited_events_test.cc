// SPDX-License-Identifier: Apache-2.0
#include "server/base/limited_events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(LimitedEvents, TwentyEventsAtOnceAreTakenAndTheOthersCounted) {
  ManualClock clock;
  std::vector<std::string> lines;
  LogLevel last_level = LogLevel::kDebug;
  {
    LimitedEvents events(clock, "failed_jobs", [&](const Event& event) {
      lines.push_back(event.ToLine());
      last_level = event.level();
    });
    for (int i = 0; i < 25; ++i) events.Log(Event("job_failed", LogLevel::kWarning));
    EXPECT_THAT(lines, AllOf(SizeIs(20), Each("job_failed")));
    lines.clear();
    clock.SleepUntil(std::chrono::seconds(1));
    events.Log(Event("job_failed", LogLevel::kInfo));
    EXPECT_THAT(lines, ElementsAre("events_left_out about=failed_jobs count=5", "job_failed"));
    lines.clear();
    events.Log(Event("job_failed", LogLevel::kWarning));
    EXPECT_THAT(lines, IsEmpty());
  }
  EXPECT_THAT(lines, ElementsAre("events_left_out about=failed_jobs count=1"));
  EXPECT_EQ(last_level, LogLevel::kWarning);
}

TEST(LimitedEvents, TheCountOfEventsThatAreNotLoggedIsNotLoggedEither) {
  ManualClock clock;
  std::vector<LogLevel> levels;
  {
    LimitedEvents events(clock, "scenes",
                         [&](const Event& event) { levels.push_back(event.level()); });
    for (int i = 0; i < 25; ++i) events.Log(Event("scene_created", LogLevel::kDebug));
  }
  EXPECT_THAT(levels, AllOf(SizeIs(21), Each(LogLevel::kDebug)));
}

}  // namespace
}  // namespace carillon
