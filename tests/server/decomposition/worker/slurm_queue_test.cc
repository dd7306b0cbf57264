// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/slurm_queue.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

SlurmState StateOf(const std::string& word) {
  return ParseSqueue("name|ticket|" + word + "\n").at({"name", "ticket"});
}

TEST(SlurmQueue, TellsWhatHasHopeFromWhatHasNone) {
  EXPECT_EQ(StateOf("PENDING"), SlurmState::kWaitsOrRuns);
  EXPECT_EQ(StateOf("COMPLETING"), SlurmState::kWaitsOrRuns);
  EXPECT_EQ(StateOf("OUT_OF_MEMORY"), SlurmState::kOutOfMemory);
  EXPECT_EQ(StateOf("TIMEOUT"), SlurmState::kTimeout);
  EXPECT_EQ(StateOf("CANCELLED by 0"), SlurmState::kCancelled);
  EXPECT_EQ(StateOf("NODE_FAIL"), SlurmState::kLost);
  EXPECT_EQ(StateOf("A_STATE_OF_THE_FUTURE"), SlurmState::kLost);
}

TEST(SlurmQueue, AJobThatItsNodeRefusedIsStuckButOneThatPeopleHoldWaits) {
  EXPECT_EQ(StateOf("PENDING|launch failed requeued held"), SlurmState::kStuck);
  EXPECT_EQ(StateOf("PENDING|JobHeldUser"), SlurmState::kWaitsOrRuns);
  EXPECT_EQ(StateOf("RUNNING|None"), SlurmState::kWaitsOrRuns);
}

TEST(SlurmQueue, OfSeveralJobsOfOneTicketTheMostHopefulCounts) {
  EXPECT_EQ(ParseSqueue("n|t|NODE_FAIL\nn|t|RUNNING\nn|t|TIMEOUT\n").at({"n", "t"}),
            SlurmState::kWaitsOrRuns);
}

TEST(SlurmQueue, TellsAnOlderSubmissionOfTheNameByItsTicket) {
  const SlurmJobs jobs = ParseSqueue("n|old|CANCELLED\nn|new|PENDING\n");
  EXPECT_EQ(jobs.at({"n", "new"}), SlurmState::kWaitsOrRuns);
  EXPECT_EQ(jobs.at({"n", "old"}), SlurmState::kCancelled);
}

TEST(SlurmQueue, IgnoresLinesThatAreNoJobs) {
  EXPECT_TRUE(ParseSqueue("slurm_load_jobs error: Unable to contact slurm controller\n\n").empty());
}

}  // namespace
}  // namespace carillon
