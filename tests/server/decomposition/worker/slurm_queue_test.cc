// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/slurm_queue.h"

#include <gtest/gtest.h>

#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

TEST(SlurmQueue, TellsWhatHasHopeFromWhatHasNone) {
  for (const auto& [word, state] :
       {std::pair("PENDING", SlurmState::kWaitsOrRuns),
        {"COMPLETING", SlurmState::kWaitsOrRuns},
        {"RUNNING|None", SlurmState::kWaitsOrRuns},
        {"PENDING|JobHeldUser", SlurmState::kWaitsOrRuns},            // held by people
        {"PENDING|launch failed requeued held", SlurmState::kStuck},  // refused by its node
        {"OUT_OF_MEMORY", SlurmState::kOutOfMemory},
        {"TIMEOUT", SlurmState::kTimeout},
        {"CANCELLED by 0", SlurmState::kCancelled},
        {"NODE_FAIL", SlurmState::kLost},
        {"A_STATE_OF_THE_FUTURE", SlurmState::kLost}}) {
    EXPECT_EQ(ParseSqueue(absl::StrCat("name|ticket|", word, "\n")).at({"name", "ticket"}), state)
        << word;
  }
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
