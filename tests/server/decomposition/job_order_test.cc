// SPDX-License-Identifier: Apache-2.0
//
// Which of the jobs that wait starts first, how many may wait and run, and who ends a job that
// several clients have asked for.
#include <gtest/gtest.h>

#include <limits>

#include "absl/strings/str_cat.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/job/wanted_job.h"
#include "server/decomposition/phase_usage.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

/// Jobs wait at a gate when they have started.
class JobOrderTest : public DecompositionQueueTest {
 protected:
  /// A queue whose jobs are told apart by their numbers of nodes.
  void MakeOrderedQueue() {
    MakeQueue(absl::StrCat("echo $nodes >>\"$here/order\"\n", kWaitAtGate, kSucceed));
  }

  v1::Job SubmitWith(uint32_t nodes, int priority, const std::string& client = "") {
    auto request = Request(20'000, nodes);
    request.set_priority(priority);
    return Submit(request, client);
  }

  /// Lets `count` jobs run, of which `last` is the last, and returns the nodes of each, a line a
  /// job.
  std::string OrderOfRuns(const v1::Job& last, int count) {
    for (int i = 0; i < count; ++i) gate_.Open();
    AwaitEnd(DigestOf(last));
    return ReadBytes(folder_ / "order");
  }

  const Gate gate_{folder_ / "gate"};
};

TEST_F(JobOrderTest, AHigherPriorityStartsFirstAndMayBeGivenLater) {
  MakeOrderedQueue();
  Await(DigestOf(SubmitWith(1, 0)), v1::JOB_STATE_RUNNING);
  const v1::Job last = SubmitWith(2, -1);
  SubmitWith(3, 0);
  SubmitWith(4, 5);
  SubmitWith(5, 0);
  EXPECT_EQ(SubmitWith(5, 7).priority(), 7);
  EXPECT_EQ(OrderOfRuns(last, 5), "1\n5\n4\n3\n2\n");
}

TEST_F(JobOrderTest, ClientsTakeTurnsWhateverThePrioritiesOfTheirJobs) {
  MakeOrderedQueue();
  Await(DigestOf(SubmitWith(1, 100, "greedy")), v1::JOB_STATE_RUNNING);
  SubmitWith(2, 100, "greedy");
  SubmitWith(3, 100, "greedy");
  const v1::Job last = SubmitWith(4, 100, "greedy");
  SubmitWith(5, 0, "modest");
  SubmitWith(6, -1, "other");
  SubmitWith(7, 1, "modest");
  EXPECT_EQ(OrderOfRuns(last, 7), "1\n7\n6\n2\n5\n3\n4\n");
}

TEST_F(JobOrderTest, OneClientsJobsDoNotFillTheQueue) {
  settings_.max_queued_count = 4;
  settings_.max_queued_count_of_client = 2;
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  for (const uint32_t nodes : {1U, 2U, 3U}) {
    ASSERT_TRUE(queue_->Submit(Request(20'000, nodes), "greedy").ok()) << nodes;
  }
  EXPECT_EQ(queue_->counts().queued, 2U);
  EXPECT_EQ(queue_->counts().running, 1U);
  EXPECT_THAT(queue_->Submit(Request(20'000, 4), "greedy").status().ToString(),
              HasSubstr("CLIENT_LIMIT_REACHED: "));
  EXPECT_TRUE(queue_->Submit(Request(20'000, 4), "modest").ok());
}

TEST_F(JobOrderTest, NoMoreRunAtATimeThanAreEstimatedToFitIntoTheMemory) {
  options_.worker_count = 4;
  options_.memory_budget_bytes = 100 << 20;  // the smallest body is estimated to take 70 MB
  MakeQueue(absl::StrCat("mkdir \"$here/alone\" || touch \"$here/crowd\"\n", kSucceed,
                         "\nrmdir \"$here/alone\""));
  std::vector<v1::Job> jobs;
  for (uint32_t i = 0; i < 4; ++i) jobs.push_back(Submit(Request(20'000, 600 + i)));
  for (const v1::Job& job : jobs) {
    EXPECT_EQ(AwaitEnd(DigestOf(job)).state(), v1::JOB_STATE_SUCCEEDED);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "crowd"));
}

/// A first job keeps the worker busy, so that all others are queued.
class JobCancelTest : public JobOrderTest {
 protected:
  void MakeBusyQueue() {
    MakeOrderedQueue();
    Await(DigestOf(SubmitWith(1, 0, "first")), v1::JOB_STATE_RUNNING);
  }

  v1::JobState CancelFor(const std::string& client, const v1::Job& job) {
    return queue_->Cancel(DigestOf(job), client)->state();
  }
};

TEST_F(JobCancelTest, AJobGoesOnUntilAllThatAskedForItHaveCancelledIt) {
  MakeBusyQueue();
  const v1::Job job = SubmitWith(2, 0, "alice");
  SubmitWith(2, 0, "bob");
  EXPECT_EQ(CancelFor("bob", job), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(CancelFor("bob", job), v1::JOB_STATE_QUEUED) << "a call may be repeated";
  EXPECT_EQ(CancelFor("alice", job), v1::JOB_STATE_CANCELLED);
}

TEST_F(JobCancelTest, AStrangerIsRefusedAndACallForAllEndsTheJob) {
  MakeBusyQueue();
  const v1::Job job = SubmitWith(2, 0, "alice");
  const auto refused = queue_->Cancel(DigestOf(job), "mallory");
  EXPECT_TRUE(absl::IsPermissionDenied(refused.status()));
  EXPECT_THAT(refused.status().ToString(), HasSubstr("JOB_OF_ANOTHER"));
  EXPECT_EQ(queue_->Get(DigestOf(job))->state(), v1::JOB_STATE_QUEUED);
  SubmitWith(2, 0, "bob");
  EXPECT_EQ(queue_->Cancel(DigestOf(job))->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(CancelFor("mallory", job), v1::JOB_STATE_CANCELLED) << "it has ended";
}

TEST_F(JobCancelTest, AJobOfAnEarlierDaemonIsCancelledByThoseThatWantedItThere) {
  MakeBusyQueue();
  const v1::Job job = SubmitWith(2, 0, "alice");
  SubmitWith(2, 0, "bob");
  SubmitWith(2, 0, "mallory");
  CancelFor("mallory", job);
  MakeOrderedQueue();
  EXPECT_TRUE(absl::IsPermissionDenied(queue_->Cancel(DigestOf(job), "mallory").status()));
  EXPECT_NE(CancelFor("bob", job), v1::JOB_STATE_CANCELLED);
  CancelFor("alice", job);
  EXPECT_EQ(AwaitEnd(DigestOf(job)).state(), v1::JOB_STATE_CANCELLED);
  // A job that is asked for again belongs to nobody who wanted the ended one.
  SubmitWith(2, 0, "mallory");
  MakeOrderedQueue();
  EXPECT_TRUE(absl::IsPermissionDenied(queue_->Cancel(DigestOf(job), "alice").status()));
}

TEST_F(JobCancelTest, TheTransferOfAModelIsWantedByThoseThatWantTheModel) {
  settings_.transfers = true;
  // The transfer waits at the gate.
  MakeQueue(absl::StrCat("grep -q radiate_stored_model \"$request\" && ", kWaitAtGate, kSucceed));
  const v1::Job model = SubmitWith(2, 0, "alice");
  SubmitWith(2, 0, "bob");
  ASSERT_EQ(AwaitEnd(DigestOf(model)).state(), v1::JOB_STATE_SUCCEEDED);
  const v1::CreateModalModelRequest resolved = *ResolveRequest(Request(20'000, 2));
  const std::string transfer = WantedTransfer(DigestOf(model), resolved).digest;
  EXPECT_THAT(queue_->Cancel(transfer, "mallory").status().ToString(), HasSubstr("JOB_OF_ANOTHER"));
  ASSERT_TRUE(queue_->Cancel(transfer, "bob").ok());
  EXPECT_EQ(queue_->Get(transfer)->state(), v1::JOB_STATE_RUNNING);
  ASSERT_TRUE(queue_->Cancel(transfer, "alice").ok());
  EXPECT_EQ(AwaitEnd(transfer).state(), v1::JOB_STATE_CANCELLED);
}

// What memory jobs are estimated to take, and what time and memory their phases take.

TEST(MemoryEstimate, GrowsAsTheFactorOfASolidDoes) {
  // Eight times the nodes of a solid fill in sixteen times the factor.
  EXPECT_NEAR(static_cast<double>(MemoryOfNodes(8e6)) / static_cast<double>(MemoryOfNodes(1e6)), 16,
              0.1);
}

TEST(MemoryEstimate, FollowsWhatIsAskedForElseTheMeshFile) {
  v1::CreateModalModelRequest request;
  request.set_mesh_format("stl");
  request.mutable_settings()->set_element(v1::ELEMENT_LINEAR);
  EXPECT_GT(GuessNodeCount(request, 10'000'000), 10 * GuessNodeCount(request, 100'000));
  request.mutable_settings()->mutable_mesh()->set_target_node_count(5000);
  EXPECT_EQ(GuessNodeCount(request, 10'000'000), 5000);
}

TEST(MemoryEstimate, ComesToWhatIsSeen) {
  MemoryExperience experience;
  for (int i = 0; i < 100; ++i) experience.Learn(1000, 3000);
  EXPECT_NEAR(static_cast<double>(experience.Corrected(1000)), 3000, 10);
  EXPECT_EQ(MemoryExperience(experience.correction()).Corrected(1000), experience.Corrected(1000));
  EXPECT_EQ(MemoryExperience(std::numeric_limits<double>::quiet_NaN()).correction(), 1);
}

using std::chrono::seconds;

v1::Progress At(v1::Phase phase, uint64_t memory_bytes) {
  v1::Progress progress;
  progress.set_phase(phase);
  progress.set_memory_bytes(memory_bytes);
  return progress;
}

TEST(PhaseUsage, TimeBelongsToThePhaseReportedBeforeIt) {
  PhaseUsage usage;
  usage.Report("a", At(v1::PHASE_MESH, 10), seconds(1));
  usage.Report("b", At(v1::PHASE_SOLVE, 70), seconds(2));
  usage.Report("a", At(v1::PHASE_SOLVE, 50), seconds(4));
  usage.End("a", seconds(9));
  usage.End("b", seconds(10));
  const PhaseUses uses = usage.uses();
  EXPECT_EQ(uses[v1::PHASE_MESH].seconds, 3);
  EXPECT_EQ(uses[v1::PHASE_SOLVE].seconds, 5 + 8);
  EXPECT_EQ(uses[v1::PHASE_MESH].peak_bytes, 10U);
  EXPECT_EQ(uses[v1::PHASE_SOLVE].peak_bytes, 70U);
}

TEST(PhaseUsage, TimeBetweenTwoRunsOfAJobBelongsToNoPhase) {
  PhaseUsage usage;
  usage.Report("a", At(v1::PHASE_MESH, 0), seconds(1));
  usage.End("a", seconds(2));
  usage.End("a", seconds(5));
  usage.Report("a", At(v1::PHASE_MESH, 0), seconds(10));
  usage.End("a", seconds(11));
  EXPECT_EQ(usage.uses()[v1::PHASE_MESH].seconds, 2);
}

}  // namespace
}  // namespace carillon
