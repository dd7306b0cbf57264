// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/job_progress.h"

#include <gtest/gtest.h>

namespace carillon::cli {
namespace {

v1::Job Waiting(v1::WaitCause cause, uint32_t earlier, uint32_t running) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_QUEUED);
  job.mutable_wait()->set_cause(cause);
  job.mutable_wait()->set_earlier_job_count(earlier);
  job.mutable_wait()->set_running_job_count(running);
  if (running == 1) job.mutable_wait()->set_running_job_label("bell");
  return job;
}

TEST(ProgressText, SaysWhatAJobWaitsFor) {
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_WORKER, 0, 1)), "  0 %  waiting for bell");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_WORKER, 0, 4)), "  0 %  waiting for one of 4 jobs");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_MEMORY, 0, 1)),
            "  0 %  waiting for the memory of bell");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_WORKER, 1, 1)),
            "  0 %  waiting: 1 job is before it");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_MEMORY, 3, 1)),
            "  0 %  waiting: 3 jobs are before it");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_COARSE_MODEL, 0, 0)),
            "  0 %  waiting for its coarse model");
  EXPECT_EQ(ProgressText(Waiting(v1::WAIT_CAUSE_UNSPECIFIED, 0, 0)), "  0 %  waiting");
}

TEST(JobLine, TellsHowLongTheJobHasWaitedOrRun) {
  v1::Job job = Waiting(v1::WAIT_CAUSE_UNSPECIFIED, 0, 0);
  job.set_name("jobs/0123456789abcdef");
  job.set_label("bowl");
  const absl::Time now = absl::FromUnixMillis(200'000);
  EXPECT_EQ(JobLine(job, now), "0123456789ab    0 %  waiting  bowl") << "of an older daemon";
  job.set_created_unix_ms(20'000);
  EXPECT_EQ(JobLine(job, now), "0123456789ab    0 %  waiting, requested 3 min ago  bowl");
  job.set_state(v1::JOB_STATE_RUNNING);
  job.set_started_unix_ms(188'000);
  EXPECT_EQ(JobLine(job, now), "0123456789ab    0 %  starting, running for 12 s  bowl");
  job.set_started_unix_ms(300'000);
  EXPECT_EQ(JobLine(job, now), "0123456789ab    0 %  starting, running for 0 s  bowl");
}

TEST(JobLine, EscapesALabelThatWouldTurnTheLineRound) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.set_label("gong\u202e\x1b[2J 鐘");
  EXPECT_EQ(JobLine(job, absl::UnixEpoch()), "  100 %  done  gong\\xe2\\x80\\xae\\x1b[2J 鐘");
}

}  // namespace
}  // namespace carillon::cli
