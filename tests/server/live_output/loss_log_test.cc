// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/loss_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace carillon {
namespace {

using ::std::chrono::seconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LossLogTest : public ::testing::Test {
 protected:
  /// Returns the lines since the last call.
  std::vector<std::string> Lines() { return std::exchange(lines_, {}); }

  std::vector<std::string> lines_;
  LossLog log_{48000, [this](const std::string& line) { lines_.push_back(line); }};
};

TEST_F(LossLogTest, NamesTheBeginningAndTheEndOfGapsOnceWithTheirFrames) {
  log_.Note(0, seconds(0), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800, seconds(1), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("the sound has gaps: 4800 frames (0.1 s) were lost")));
  for (int second = 2; second < 100; ++second) log_.Note(4800U * second, seconds(second), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99, seconds(158), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99, seconds(159), false);
  EXPECT_THAT(Lines(), ElementsAre(AllOf(HasSubstr("no gaps for 60 s"),
                                         HasSubstr("475200 frames (9.9 s) were lost"))));
  log_.Note(4800U * 99, seconds(250), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99 + 48, seconds(350), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("gaps: 48 frames (0.001 s) were lost")));
}

TEST_F(LossLogTest, FramesOfAFaultThatTheLogNamesAreNoGaps) {
  log_.Note(100, seconds(1), true);
  log_.Note(200, seconds(2), true);
  log_.Note(300, seconds(3), false);  // lost before the fault ended
  log_.Note(300, seconds(90), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(400, seconds(91), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("gaps: 100 frames")));
}

}  // namespace
}  // namespace carillon
