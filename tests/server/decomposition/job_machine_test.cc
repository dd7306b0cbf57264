// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_machine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/base/sha256.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/worker/worker_command.h"
#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

v1::CreateModalModelRequest RequestUpTo(double max_frequency_hz) {
  v1::CreateModalModelRequest request = SampleRequest(Sha256Hex("solid"));
  request.set_max_frequency_hz(max_frequency_hz);
  return *ResolveRequest(request);
}

/// A job in a stage, which two clients want.
ActiveJob JobIn(JobStage stage) {
  ActiveJob job{.record = {.digest = "d"}, .request = RequestUpTo(1000), .stage = stage};
  job.given = job.request;
  job.client = "one";
  for (const char* client : {"one", "two"}) job.wishes.Add(client);
  job.record.request = job.request.SerializeAsString();
  job.record.start_count = job.runs() ? 1 : 0;
  job.estimate_bytes = 100;
  return job;
}

JobStep OnEndOf(JobStage stage, const Outcome& outcome) {
  return Transition(JobIn(stage), RunEnded{outcome});
}

Outcome Failed(Verdict verdict, const std::string& reason) {
  Outcome outcome{.verdict = verdict};
  outcome.error.set_reason(reason);
  return outcome;
}

TEST(JobMachine, ACancelEndsAWaitingJobAtOnceAndARunningOneWithItsRun) {
  for (const JobStage stage : {JobStage::kAwaitsCoarse, JobStage::kWaits}) {
    const JobStep step = Transition(JobIn(stage), Cancelled{});
    EXPECT_EQ(step.action, JobAction::kEnd);
    EXPECT_EQ(step.job.record.state, v1::JOB_STATE_CANCELLED);
  }
  for (const JobStage stage : {JobStage::kRuns, JobStage::kRunsThenWaits, JobStage::kYields}) {
    const JobStep step = Transition(JobIn(stage), Cancelled{});
    EXPECT_EQ(step.action, JobAction::kStopRun);
    EXPECT_EQ(step.job.stage, JobStage::kCancelled);
    EXPECT_THAT(step.job.wishes.Wanting(), IsEmpty());
    const JobStep end = Transition(step.job, RunEnded{{.verdict = Verdict::kCancelled}});
    EXPECT_EQ(end.action, JobAction::kEnd);
    EXPECT_EQ(end.job.record.state, v1::JOB_STATE_CANCELLED);
  }
}

TEST(JobMachine, ARequestAfterACancelMakesTheJobWaitAgainAfterItsRun) {
  const JobStep cancelled = Transition(JobIn(JobStage::kRuns), Cancelled{});
  const JobStep wanted = Transition(cancelled.job, Submitted{RequestUpTo(1000), "three"});
  EXPECT_EQ(wanted.job.stage, JobStage::kRunsThenWaits);
  EXPECT_EQ(wanted.job.record.state, v1::JOB_STATE_QUEUED);
  EXPECT_THAT(wanted.job.wishes.Wanting(), ElementsAre("three"));
  const JobStep end = Transition(wanted.job, RunEnded{{.verdict = Verdict::kCancelled}});
  EXPECT_EQ(end.action, JobAction::kWaitAgain);
  EXPECT_EQ(end.job.stage, JobStage::kWaits);
  EXPECT_EQ(end.job.record.start_count, 0U) << "the daemon is not to blame";
}

TEST(JobMachine, TheRunOfADeletedModelLeavesNoResultEvenIfTheModelIsWantedAgain) {
  const JobStep deleted = Transition(JobIn(JobStage::kRuns), ModelDeleted{});
  EXPECT_EQ(deleted.action, JobAction::kStopRun);
  EXPECT_TRUE(deleted.job.deleted());
  const JobStep again = Transition(deleted.job, Submitted{RequestUpTo(1000), "three"});
  EXPECT_TRUE(again.job.deleted());
  const JobStep end = Transition(again.job, RunEnded{{.verdict = Verdict::kOk}});
  EXPECT_EQ(end.action, JobAction::kWaitAgain);
  EXPECT_FALSE(end.job.deleted());
  EXPECT_EQ(Transition(again.job, Cancelled{}).job.stage, JobStage::kDeleted);
  EXPECT_EQ(Transition(JobIn(JobStage::kWaits), ModelDeleted{}).action, JobAction::kEnd);
}

TEST(JobMachine, ARequestThatReachesFartherExtendsTheJobAndRepeatsItsRun) {
  const JobStep nearer = Transition(JobIn(JobStage::kRuns), Submitted{RequestUpTo(500), "three"});
  EXPECT_EQ(nearer.job.request.max_frequency_hz(), 1000);
  EXPECT_EQ(Transition(nearer.job, RunEnded{{.verdict = Verdict::kOk}}).action, JobAction::kEnd);
  const JobStep farther = Transition(JobIn(JobStage::kRuns), Submitted{RequestUpTo(2000), "three"});
  EXPECT_EQ(farther.job.record.request, RequestUpTo(2000).SerializeAsString());
  for (const Outcome& outcome :
       {Outcome{.verdict = Verdict::kOk}, Failed(Verdict::kBadInput, "NO_MODE_IN_BAND")}) {
    EXPECT_EQ(Transition(farther.job, RunEnded{outcome}).action, JobAction::kWaitAgain);
  }
  const Outcome refused = Failed(Verdict::kBadInput, "MESH_NOT_CLOSED");
  EXPECT_EQ(Transition(farther.job, RunEnded{refused}).action, JobAction::kEnd)
      << "which depends on the mesh alone";
}

TEST(JobMachine, ARequestThatStatesTheUnitRepeatsARunThatLackedItAndNoOther) {
  v1::CreateModalModelRequest stated = RequestUpTo(1000);
  stated.mutable_settings()->set_metres_per_unit(1);
  const JobStep step = Transition(JobIn(JobStage::kRuns), Submitted{stated, "three"});
  const Outcome unclear = Failed(Verdict::kBadInput, "MESH_UNIT_UNCLEAR");
  EXPECT_EQ(Transition(step.job, RunEnded{unclear}).action, JobAction::kWaitAgain);
  EXPECT_EQ(Transition(step.job, RunEnded{{.verdict = Verdict::kOk}}).action, JobAction::kEnd);
  EXPECT_EQ(OnEndOf(JobStage::kRuns, unclear).action, JobAction::kEnd);
}

TEST(JobMachine, ATransferRunsAgainAfterItsModelWasReplaced) {
  JobWishes wishes;
  wishes.Add("three");
  for (const JobStage stage : {JobStage::kRuns, JobStage::kCancelled}) {
    const JobStep step = Transition(JobIn(stage), ModelReplaced{wishes});
    EXPECT_EQ(step.job.stage, JobStage::kRunsThenWaits);
    EXPECT_TRUE(step.job.wishes.IsWantedBy("three"));
  }
  EXPECT_EQ(Transition(JobIn(JobStage::kYields), ModelReplaced{wishes}).job.stage,
            JobStage::kYields);
  EXPECT_EQ(Transition(JobIn(JobStage::kWaits), ModelReplaced{wishes}).job.stage, JobStage::kWaits);
}

TEST(JobMachine, ARunThatYieldsIsRepeatedUnlessItEndedFirst) {
  EXPECT_EQ(OnEndOf(JobStage::kYields, {.verdict = Verdict::kCancelled}).action,
            JobAction::kWaitAgain);
  EXPECT_EQ(OnEndOf(JobStage::kYields, {.verdict = Verdict::kOk}).action, JobAction::kEnd);
}

TEST(JobMachine, AJobThatSomebodyElseKilledRunsOnceMore) {
  Outcome outcome = Failed(Verdict::kOutOfMemory, "OUT_OF_MEMORY");
  outcome.killed = true;
  outcome.peak_bytes = 1000;
  const JobStep once = OnEndOf(JobStage::kRuns, outcome);
  EXPECT_EQ(once.action, JobAction::kWaitAgain);
  EXPECT_EQ(once.job.estimate_bytes, 1500U);
  EXPECT_THAT(once.note, HasSubstr("jobs/d is computed once more"));
  ActiveJob job = once.job;
  job.stage = JobStage::kRuns;
  const JobStep twice = Transition(job, RunEnded{outcome});
  EXPECT_EQ(twice.action, JobAction::kEnd);
  EXPECT_EQ(twice.job.record.state, v1::JOB_STATE_FAILED);
  EXPECT_EQ(twice.job.record.error.reason(), "OUT_OF_MEMORY");
  EXPECT_FALSE(twice.job.record.remembered);
}

TEST(JobMachine, ACrashIsTriedAnotherWayUntilNoneIsLeft) {
  ActiveJob job = JobIn(JobStage::kRuns);
  const RunEnded crash{Failed(Verdict::kCrashed, "WORKER_CRASHED")};
  for (uint32_t way = 1; way < kWayCount; ++way) {
    const JobStep step = Transition(job, crash);
    EXPECT_EQ(step.action, JobAction::kWaitAgain);
    EXPECT_EQ(step.job.record.way, way);
    job = step.job;
    job.stage = JobStage::kRuns;
  }
  const JobStep last = Transition(job, crash);
  EXPECT_EQ(last.action, JobAction::kEnd);
  EXPECT_TRUE(last.job.record.remembered);
  ActiveJob transfer = JobIn(JobStage::kRuns);
  transfer.record.transfer_of = "model";
  EXPECT_EQ(Transition(transfer, crash).action, JobAction::kEnd) << "it has one way only";
}

TEST(JobMachine, ACrowdedRunIsRepeatedWithMoreMemoryAsOftenAsNeeded) {
  Outcome crowded = Failed(Verdict::kOutOfMemory, "OUT_OF_MEMORY");
  crowded.crowded = true;
  ActiveJob job = JobIn(JobStage::kRuns);
  for (const uint64_t bytes : {200U, 400U, 800U}) {
    const JobStep step = Transition(job, RunEnded{crowded});
    EXPECT_EQ(step.action, JobAction::kWaitAgain);
    EXPECT_EQ(step.job.estimate_bytes, bytes);
    job.estimate_bytes = step.job.estimate_bytes;
  }
}

TEST(JobMachine, AJobGoesOnForTheOthersWhenOneClientWithdraws) {
  const JobStep step = Transition(JobIn(JobStage::kRuns), Withdrawn{"one"});
  EXPECT_EQ(step.action, JobAction::kGoOn);
  EXPECT_EQ(step.job.client, "two");
  EXPECT_FALSE(step.job.wishes.IsWantedBy("one"));
}

TEST(JobMachine, AJobWaitsForAWorkerWhenItsCoarseModelHasCome) {
  ActiveJob job = JobIn(JobStage::kAwaitsCoarse);
  job.waits_for = "coarse";
  const JobStep step = Transition(job, CoarseEnded{.copied = true});
  EXPECT_EQ(step.job.stage, JobStage::kWaits);
  EXPECT_TRUE(step.job.coarse_ready);
  EXPECT_EQ(step.job.waits_for, "");
}

TEST(JobMachine, TheHighestPeakOfItsRunsStaysWithTheJob) {
  ActiveJob job = JobIn(JobStage::kRuns);
  job.record.peak_bytes = 70;
  Outcome outcome{.verdict = Verdict::kOk};
  outcome.peak_bytes = 60;
  EXPECT_EQ(Transition(job, RunEnded{outcome}).job.record.peak_bytes, 70U);
}

}  // namespace
}  // namespace carillon
