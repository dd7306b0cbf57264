// SPDX-License-Identifier: Apache-2.0
//
// Who ends a job that several clients have asked for.
#include "absl/strings/str_cat.h"
#include "server/decomposition/job/wanted_job.h"
#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

/// One worker, which waits at a gate. A first job keeps it busy, so that all others are queued.
class JobCancelTest : public DecompositionQueueTest {
 protected:
  void MakeBusyQueue() {
    MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
    const auto watch = Watch(SubmitFor("first", 1), first_);
    first_.Await(v1::JOB_STATE_RUNNING);
  }

  v1::Job SubmitFor(const std::string& client, uint32_t node_count) {
    const auto job = queue_->Submit(Request(20'000, node_count), client);
    EXPECT_TRUE(job.ok()) << job.status();
    return job.value_or(v1::Job());
  }

  v1::JobState CancelFor(const std::string& client, const v1::Job& job) {
    const auto cancelled = queue_->Cancel(DigestOf(job), client);
    EXPECT_TRUE(cancelled.ok()) << cancelled.status();
    return cancelled.ok() ? cancelled->state() : v1::JOB_STATE_UNSPECIFIED;
  }

  /// Cancels a job that no other client wants, and waits until it has ended.
  void CancelToTheEnd(const std::string& client, const v1::Job& job) {
    Diary end;
    const auto watch = Watch(job, end);
    CancelFor(client, job);
    EXPECT_EQ(end.AwaitEnd().state(), v1::JOB_STATE_CANCELLED);
  }

  const Gate gate_{folder_ / "gate"};
  Diary first_;
};

TEST_F(JobCancelTest, AJobGoesOnUntilAllThatAskedForItHaveCancelledIt) {
  MakeBusyQueue();
  const v1::Job job = SubmitFor("alice", 2);
  SubmitFor("bob", 2);
  EXPECT_EQ(CancelFor("bob", job), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(CancelFor("bob", job), v1::JOB_STATE_QUEUED) << "a call may be repeated";
  EXPECT_EQ(CancelFor("alice", job), v1::JOB_STATE_CANCELLED);
}

TEST_F(JobCancelTest, AStrangerIsRefusedAndACallForAllEndsTheJob) {
  MakeBusyQueue();
  const v1::Job job = SubmitFor("alice", 2);
  const auto refused = queue_->Cancel(DigestOf(job), "mallory");
  EXPECT_TRUE(absl::IsPermissionDenied(refused.status()));
  EXPECT_THAT(refused.status().ToString(), HasSubstr("JOB_OF_ANOTHER"));
  EXPECT_EQ(queue_->Get(DigestOf(job))->state(), v1::JOB_STATE_QUEUED);
  SubmitFor("bob", 2);
  EXPECT_EQ(queue_->Cancel(DigestOf(job))->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(CancelFor("mallory", job), v1::JOB_STATE_CANCELLED) << "it has ended";
}

TEST_F(JobCancelTest, AJobOfAnEarlierDaemonIsCancelledByThoseThatWantedItThere) {
  MakeBusyQueue();
  const v1::Job job = SubmitFor("alice", 2);
  SubmitFor("bob", 2);
  SubmitFor("mallory", 2);
  CancelFor("mallory", job);
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  EXPECT_TRUE(absl::IsPermissionDenied(queue_->Cancel(DigestOf(job), "mallory").status()));
  EXPECT_NE(CancelFor("bob", job), v1::JOB_STATE_CANCELLED);
  CancelToTheEnd("alice", job);
  // A job that is asked for again belongs to nobody who wanted the ended one.
  SubmitFor("mallory", 2);
  MakeQueue(absl::StrCat(kWaitAtGate, kSucceed));
  EXPECT_TRUE(absl::IsPermissionDenied(queue_->Cancel(DigestOf(job), "alice").status()));
}

TEST_F(JobCancelTest, TheTransferOfAModelIsWantedByThoseThatWantTheModel) {
  settings_.transfers = true;
  // The transfer waits at the gate.
  MakeQueue(absl::StrCat("grep -q radiate_stored_model \"$request\" && ", kWaitAtGate, kSucceed));
  Diary diary;
  const v1::Job model = SubmitFor("alice", 2);
  SubmitFor("bob", 2);
  const auto watch = Watch(model, diary);
  ASSERT_EQ(diary.AwaitEnd().state(), v1::JOB_STATE_SUCCEEDED);
  const v1::CreateModalModelRequest resolved = *ResolveRequest(Request(20'000, 2));
  const std::string transfer = WantedTransfer(DigestOf(model), resolved).digest;
  EXPECT_THAT(queue_->Cancel(transfer, "mallory").status().ToString(), HasSubstr("JOB_OF_ANOTHER"));
  ASSERT_TRUE(queue_->Cancel(transfer, "bob").ok());
  EXPECT_EQ(queue_->Get(transfer)->state(), v1::JOB_STATE_RUNNING);
  Diary end;
  const auto watch_end = queue_->Watch(transfer, [&end](const v1::Job& job) { end.Write(job); });
  ASSERT_TRUE(watch_end.ok()) << watch_end.status();
  ASSERT_TRUE(queue_->Cancel(transfer, "alice").ok());
  EXPECT_EQ(end.AwaitEnd().state(), v1::JOB_STATE_CANCELLED);
}

}  // namespace
}  // namespace carillon
