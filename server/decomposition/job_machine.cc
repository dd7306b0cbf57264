// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_machine.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/decomposition/job/job_rules.h"
#include "server/decomposition/worker/worker_command.h"

namespace carillon {
namespace {

// After a run that lacked memory.
uint64_t LargerEstimate(const ActiveJob& job, const Outcome& outcome) {
  return std::max(2 * job.estimate_bytes, outcome.peak_bytes * 3 / 2);
}

// The stage of a running job that is wanted again after its present run.
JobStage ThenWaits(const ActiveJob& job) {
  if (job.deleted()) return JobStage::kDeletedThenWaits;
  return job.stage == JobStage::kYields ? JobStage::kYields : JobStage::kRunsThenWaits;
}

JobStep On(ActiveJob job, const Submitted& event) {
  if (IsWantedNoMore(job) || WantsMore(event.request, job.request)) {
    job.request = event.request;
    job.record.request = event.request.SerializeAsString();
  }
  if (IsWantedNoMore(job)) job.stage = ThenWaits(job);
  job.record.state = v1::JOB_STATE_QUEUED;
  job.record.priority = std::max(job.record.priority, event.request.priority());
  job.wishes.Add(event.client);
  return {std::move(job)};
}

JobStep On(ActiveJob job, const Wished& event) {
  job.wishes.Add(event.client);
  return {std::move(job)};
}

JobStep On(ActiveJob job, const ModelReplaced& event) {
  job.wishes.Add(event.wishes);
  job.record.state = v1::JOB_STATE_QUEUED;
  if (job.runs()) job.stage = ThenWaits(job);
  return {std::move(job)};
}

JobStep On(ActiveJob job, const Withdrawn& event) {
  const std::string other = job.wishes.OtherThan(event.client);
  job.wishes.Withdraw(event.client);
  if (job.client == event.client) job.client = other;
  return {std::move(job)};
}

// A running job is there until its worker has ended.
JobStep EndNow(ActiveJob job, JobStage ending) {
  job.record.state = v1::JOB_STATE_CANCELLED;
  job.wishes.Clear();
  if (!job.runs()) return {std::move(job), JobAction::kEnd};
  job.stage = ending;
  return {std::move(job), JobAction::kStopRun};
}

JobStep On(ActiveJob job, const Cancelled& /*event*/) {
  const bool deleted = job.deleted();
  return EndNow(std::move(job), deleted ? JobStage::kDeleted : JobStage::kCancelled);
}

JobStep On(ActiveJob job, const ModelDeleted& /*event*/) {
  return EndNow(std::move(job), JobStage::kDeleted);
}

JobStep On(ActiveJob job, const CoarseEnded& event) {
  job.waits_for.clear();
  job.coarse_ready = event.copied;
  job.stage = JobStage::kWaits;
  return {std::move(job)};
}

JobStep RunAgain(ActiveJob job, std::string note = {}) {
  job.stage = JobStage::kWaits;
  return {std::move(job), JobAction::kWaitAgain, std::move(note)};
}

JobStep End(ActiveJob job, const Outcome& outcome) {
  job.record.state = StateOf(outcome.verdict);
  job.record.remembered = IsDeterministic(outcome);
  if (job.record.state == v1::JOB_STATE_FAILED) job.record.error = outcome.error;
  return {std::move(job), JobAction::kEnd};
}

// A request with other hints has come while the job ran, and the result may depend on them.
bool LeavesHintsUnserved(const ActiveJob& job, const Outcome& outcome) {
  if (StatesUnit(job.request) && outcome.error.reason() == "MESH_UNIT_UNCLEAR") return true;
  if (SameHints(job.request, job.given)) return false;
  return outcome.verdict == Verdict::kOk ||
         (outcome.verdict == Verdict::kBadInput && DependsOnHints(outcome.error.reason()));
}

// The end of a run whose result, or whose failure, is what the job is for.
JobStep OnWantedEnd(ActiveJob job, const Outcome& outcome) {
  if (outcome.crowded) {
    job.estimate_bytes = LargerEstimate(job, outcome);
    return RunAgain(std::move(job));
  }
  const std::string name = absl::StrCat("jobs/", job.record.digest);
  if (outcome.killed && !std::exchange(job.was_killed, true)) {
    if (outcome.verdict == Verdict::kOutOfMemory) job.estimate_bytes = LargerEstimate(job, outcome);
    return RunAgain(std::move(job),
                    absl::StrCat(name, " is computed once more, because its process was killed"));
  }
  const bool radiates = !job.record.transfer_of.empty();
  if (!radiates && DependsOnWay(outcome) && job.record.way + 1 < kWayCount) {
    ++job.record.way;
    return RunAgain(std::move(job),
                    absl::StrCat(name, " is computed another way after ", outcome.error.message()));
  }
  if (LeavesHintsUnserved(job, outcome)) return RunAgain(std::move(job));
  return End(std::move(job), outcome);
}

JobStep On(ActiveJob job, const RunEnded& event) {
  const Outcome& outcome = event.outcome;
  job.record.start_count = 0;
  job.record.peak_bytes = std::max(job.record.peak_bytes, outcome.peak_bytes);
  switch (job.stage) {
    case JobStage::kRunsThenWaits:
    case JobStage::kDeletedThenWaits:
      return RunAgain(std::move(job));
    case JobStage::kYields:
      // It may have ended before it was told to.
      return outcome.verdict == Verdict::kCancelled ? RunAgain(std::move(job))
                                                    : OnWantedEnd(std::move(job), outcome);
    case JobStage::kCancelled:
    case JobStage::kDeleted:
      return End(std::move(job), outcome);
    default:
      return outcome.verdict == Verdict::kCancelled ? End(std::move(job), outcome)
                                                    : OnWantedEnd(std::move(job), outcome);
  }
}

}  // namespace

bool IsWantedNoMore(const ActiveJob& job) {
  return job.stage == JobStage::kCancelled || job.stage == JobStage::kDeleted;
}

JobStep Transition(ActiveJob job, const JobEvent& event) {
  return std::visit([&job](const auto& happened) { return On(std::move(job), happened); }, event);
}

}  // namespace carillon
