// SPDX-License-Identifier: Apache-2.0
//
// Which of the jobs that wait starts first, and how many may wait and run.
#include "absl/strings/str_cat.h"
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

  /// Lets `count` jobs run, of which `last` is the last, and returns the nodes of each, a line a
  /// job.
  std::string OrderOfRuns(const v1::Job& last, int count) {
    Diary diary;
    const auto watch = Watch(last, diary);
    for (int i = 0; i < count; ++i) gate_.Open();
    diary.AwaitEnd();
    return ReadBytes(folder_ / "order");
  }

  const Gate gate_{folder_ / "gate"};
};

TEST_F(JobOrderTest, AHigherPriorityStartsFirstAndMayBeGivenLater) {
  MakeOrderedQueue();
  const auto with_priority = [&](uint32_t nodes, int priority) {
    auto request = Request(20'000, nodes);
    request.set_priority(priority);
    return request;
  };
  Diary first;
  const auto watch = Watch(Submit(with_priority(1, 0)), first);
  first.Await(v1::JOB_STATE_RUNNING);
  const v1::Job last = Submit(with_priority(2, -1));
  Submit(with_priority(3, 0));
  Submit(with_priority(4, 5));
  Submit(with_priority(5, 0));
  EXPECT_EQ(Submit(with_priority(5, 7)).priority(), 7);
  EXPECT_EQ(OrderOfRuns(last, 5), "1\n5\n4\n3\n2\n");
}

TEST_F(JobOrderTest, ClientsTakeTurnsWhateverThePrioritiesOfTheirJobs) {
  MakeOrderedQueue();
  const auto submit = [&](const std::string& client, uint32_t nodes, int priority) {
    auto request = Request(20'000, nodes);
    request.set_priority(priority);
    const absl::StatusOr<v1::Job> job = queue_->Submit(request, client);
    EXPECT_TRUE(job.ok()) << job.status();
    return job.value_or(v1::Job());
  };
  Diary first;
  const auto watch = Watch(submit("greedy", 1, 100), first);
  first.Await(v1::JOB_STATE_RUNNING);
  submit("greedy", 2, 100);
  submit("greedy", 3, 100);
  const v1::Job last = submit("greedy", 4, 100);
  submit("modest", 5, 0);
  submit("other", 6, -1);
  submit("modest", 7, 1);
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
    Diary diary;
    const auto watch = Watch(job, diary);
    EXPECT_EQ(diary.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "crowd"));
}

}  // namespace
}  // namespace carillon
