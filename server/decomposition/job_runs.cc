// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_runs.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/decomposition/job_rules.h"
#include "server/decomposition/stored_model.h"
#include "server/decomposition/worker_command.h"

namespace carillon {
namespace {

constexpr char kCorrectionFact[] = "memory_correction";
constexpr double kWeightOfNewestRun = 0.1;

}  // namespace

JobRuns::JobRuns(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
                 ActiveJobs& jobs, std::function<void(const std::string& line)> log)
    : database_(database),
      clock_(clock),
      jobs_(jobs),
      log_(std::move(log)),
      executor_(std::move(executor)),
      capacity_{executor_->worker_count(), executor_->memory_budget_bytes()} {}

void JobRuns::RecallExperience() {
  const auto correction = database_.jobs().Fact(kCorrectionFact);
  double factor = 1;
  if (correction.ok() && correction->has_value() && absl::SimpleAtod(**correction, &factor)) {
    jobs_.SetExperience(MemoryExperience(factor));
  }
}

void JobRuns::Stop() {
  {
    MutexLock lock(&writer_);
    stopping_ = true;
    // The daemon ends these runs; the jobs are not to blame, so the starts do not count.
    for (ActiveJob& job : jobs_.Running()) {
      if (job.deleted || job.record.start_count == 0) continue;
      --job.record.start_count;
      database_.jobs().Put(job.record).IgnoreError();
    }
  }
  executor_.reset();
}

void JobRuns::StartWhatFits(Notices& notices) {
  while (!stopping_) {
    const std::optional<ActiveJob> job = jobs_.BeginRun(capacity_, clock_.Monotonic());
    if (!job.has_value()) return;
    // If the start cannot be stored, a daemon that is killed under the job counts one start less.
    database_.jobs().Put(job->record).IgnoreError();
    executor_->Start(MakeTask(*job));
    notices.push_back(jobs_.Change(job->record.digest, [](ActiveJob&) {}));
  }
}

void JobRuns::Cancel(const std::string& digest) {
  if (!stopping_) executor_->Cancel(digest);
}

void JobRuns::ReleaseWaiting(const std::string& coarse, Notices& notices) {
  for (const std::string& digest : jobs_.WaitingFor(coarse)) {
    const std::optional<ActiveJob> waiting = jobs_.Find(digest);
    // Fails if the coarse job has failed and left no model. The wait is over in either case.
    database_.models().CopyIfAbsent(coarse, digest, waiting->record.label).IgnoreError();
    const bool copied = HasCoarseModel(database_.models(), digest, waiting->request);
    notices.push_back(jobs_.Change(digest, [copied](ActiveJob& job) {
      job.waits_for.clear();
      job.coarse_ready = copied;
    }));
  }
}

DecompositionTask JobRuns::MakeTask(const ActiveJob& job) {
  const std::string& digest = job.record.digest;
  return {.digest = digest,
          .request = job.request,
          .way = job.record.way,
          .estimate_bytes = job.estimate_bytes,
          .write_mesh =
              [this, mesh = job.request.mesh_digest()](const std::filesystem::path& file) {
                return database_.meshes().WriteFile(mesh, file);
              },
          .on_progress = [this, digest](const v1::Progress& p) { jobs_.Report(digest, p).Tell(); },
          .on_end = [this, digest](const Outcome& outcome) { OnEnd(digest, outcome); }};
}

void JobRuns::OnEnd(const std::string& digest, const Outcome& outcome) {
  const Outcome result = Store(digest, outcome);
  Notices notices;
  {
    MutexLock lock(&writer_);
    ActiveJob job = jobs_.EndRun(digest);
    LearnFrom(job, result);
    // Fails if the model was deleted before it was stored: then there is none.
    if (job.deleted) database_.models().Delete(digest).IgnoreError();
    job.record.start_count = 0;
    if (RunsAgain(job, result)) {
      job.again = job.deleted = false;
      notices.push_back(jobs_.QueueAgain(std::move(job)));
    } else {
      notices.push_back(Finish(std::move(job.record), result, job.deleted));
      ReleaseWaiting(digest, notices);
    }
    StartWhatFits(notices);
  }
  for (const Notice& notice : notices) notice.Tell();
}

// Puts the model into the database, without the writer's lock. An error in storing it is then the
// outcome of the job.
Outcome JobRuns::Store(const std::string& digest, const Outcome& outcome) {
  if (outcome.verdict != Verdict::kOk) return outcome;
  const std::optional<ActiveJob> job = jobs_.Find(digest);
  if (job->deleted) return {Verdict::kCancelled, {}, {}};
  const auto stored = database_.models().PutFile(digest, job->record.label, outcome.model_file);
  if (stored.ok()) return outcome;
  return {Verdict::kCrashed, ToErrorInfo(stored.status()), {}};
}

bool JobRuns::RunsAgain(ActiveJob& job, const Outcome& result) const {
  if (job.again) return true;
  const bool cancelled = job.record.state == v1::JOB_STATE_CANCELLED;
  if (cancelled || job.deleted || result.verdict == Verdict::kCancelled) return false;
  if (result.crowded) {
    job.estimate_bytes = std::max(2 * job.estimate_bytes, result.peak_bytes * 3 / 2);
    return true;
  }
  if (DependsOnWay(result) && job.record.way + 1 < kWayCount) {
    ++job.record.way;
    log_(absl::StrCat("jobs/", job.record.digest, " is computed another way after ",
                      result.error.message()));
    return true;
  }
  if (SameHints(job.request, *job.running)) return false;
  if (result.verdict == Verdict::kBadInput) return DependsOnHints(result.error.reason());
  return result.verdict == Verdict::kOk;
}

Notice JobRuns::Finish(JobRecord record, const Outcome& result, bool deleted) {
  record.state = StateOf(result.verdict);
  record.remembered = IsDeterministic(result);
  if (record.state == v1::JOB_STATE_FAILED) record.error = result.error;
  // If the end cannot be stored, the row still says queued, and the next start of the daemon ends
  // the job.
  if (!deleted) database_.jobs().Put(record).IgnoreError();
  return jobs_.Remove(record.digest, ToJob(record));
}

void JobRuns::LearnFrom(ActiveJob& job, const Outcome& result) {
  job.record.peak_bytes = std::max(job.record.peak_bytes, result.peak_bytes);
  const double run_s = std::chrono::duration<double>(clock_.Monotonic() - job.started).count();
  mean_run_s_ += kWeightOfNewestRun * (run_s - mean_run_s_);
  if (result.verdict != Verdict::kOk || result.peak_bytes == 0) return;
  const double correction = jobs_.Learn(job.guess_bytes, result.peak_bytes);
  database_.jobs().PutFact(kCorrectionFact, absl::StrCat(correction)).IgnoreError();
}

}  // namespace carillon
