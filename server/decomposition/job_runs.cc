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
#include "server/decomposition/memory_estimate.h"
#include "server/decomposition/stored_model.h"
#include "server/decomposition/wanted_job.h"
#include "server/decomposition/worker_command.h"

namespace carillon {
namespace {

constexpr char kCorrectionFact[] = "memory_correction";
constexpr double kWeightOfNewestRun = 0.1;
// A transfer holds the model's shapes as double numbers, and the fields on surfaces of some ten
// thousand vertices.
constexpr uint64_t kTransferBytes = uint64_t{256} << 20U;
constexpr uint64_t kTransferTimesModel = 4;

uint64_t GuessBytes(ModeDatabase& database, const JobRecord& record,
                    const v1::CreateModalModelRequest& request) {
  if (!record.transfer_of.empty()) {
    const auto model = database.models().Summary(record.transfer_of);
    return kTransferBytes + (model.ok() ? kTransferTimesModel * model->stored_bytes : 0);
  }
  const auto mesh = database.meshes().Find(request.mesh_digest());
  return MemoryOfNodes(GuessNodeCount(request, mesh.ok() ? mesh->byte_count : 0));
}

}  // namespace

JobRuns::JobRuns(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
                 ActiveJobs& jobs, QueueSettings settings)
    : database_(database),
      clock_(clock),
      jobs_(jobs),
      settings_(std::move(settings)),
      events_(clock, settings_.log_event),
      executor_(std::move(executor)),
      worker_count_(executor_->worker_count()) {
  jobs_.SetCapacity({.worker_count = worker_count_,
                     .memory_budget_bytes = executor_->memory_budget_bytes(),
                     .transfers_yield = executor_->transfers_yield()});
}

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

void JobRuns::Enqueue(JobRecord record, v1::CreateModalModelRequest request, JobOrigin origin) {
  record.state = v1::JOB_STATE_QUEUED;
  const bool coarse_ready = HasCoarseModel(database_.models(), record.digest, request);
  const uint64_t guess_bytes = GuessBytes(database_, record, request);
  jobs_.Add({.record = std::move(record),
             .request = std::move(request),
             .client = std::move(origin.client),
             .wishes = std::move(origin.wishes),
             .waits_for = std::move(origin.waits_for),
             .coarse_ready = coarse_ready,
             .guess_bytes = guess_bytes});
}

// The transfer's job is stored before the end of the model's, so that a daemon that is killed in
// between finds it.
void JobRuns::FollowByTransfer(const ActiveJob& model) {
  if (!settings_.transfers || !model.record.transfer_of.empty() ||
      model.running->without_transfer()) {
    return;
  }
  WantedJob wanted = WantedTransfer(model.record.digest, *model.running);
  if (jobs_.Contains(wanted.digest)) {
    // It runs on an older revision of the model.
    jobs_.Change(wanted.digest, [&model](ActiveJob& job) {
      job.again = job.running.has_value();
      job.wishes.Add(model.wishes);
    });
    // A wish that cannot be stored ends with the daemon.
    for (const std::string& client : model.wishes.Wanting()) {
      database_.jobs().AddClient(wanted.digest, client).IgnoreError();
    }
    return;
  }
  JobRecord record = NewRecord(wanted, clock_.UnixMs());
  const absl::Status stored = database_.jobs().Put(record, model.wishes.Wanting());
  if (!stored.ok()) return settings_.log(std::string(stored.message()));
  JobOrigin origin{.client = model.client};
  origin.wishes.Add(model.wishes);
  Enqueue(std::move(record), std::move(wanted.request), std::move(origin));
}

void JobRuns::StartWhatFits(Notices& notices) {
  while (!stopping_) {
    const std::optional<ActiveJob> job = jobs_.BeginRun(clock_);
    if (!job.has_value()) break;
    // If the start cannot be stored, a daemon that is killed under the job counts one start less.
    database_.jobs().Put(job->record).IgnoreError();
    executor_->Start(MakeTask(*job));
    notices.push_back(jobs_.Change(job->record.digest, [](ActiveJob&) {}));
  }
  if (stopping_) return;
  for (const std::string& digest : jobs_.BeginYielding()) executor_->Cancel(digest);
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
  const bool radiates = !job.record.transfer_of.empty();
  return {
      .digest = digest,
      .radiates = radiates,
      .request = job.request,
      .way = job.record.way,
      .estimate_bytes = job.estimate_bytes,
      .write_input =
          [this, radiates, from = radiates ? job.record.transfer_of : job.request.mesh_digest()](
              const std::filesystem::path& file) {
            return radiates ? WriteModelFile(database_.models(), from, file)
                            : database_.meshes().WriteFile(from, file);
          },
      .on_progress = [this, digest](const v1::Progress& progress) { OnProgress(digest, progress); },
      .on_end = [this, digest](const Outcome& outcome) { OnEnd(digest, outcome); }};
}

void JobRuns::OnProgress(const std::string& digest, const v1::Progress& progress) {
  phases_.Report(digest, progress, clock_.Monotonic());
  jobs_.Report(digest, progress).Tell();
}

void JobRuns::OnEnd(const std::string& digest, const Outcome& outcome) {
  phases_.End(digest, clock_.Monotonic());
  const Outcome result = Store(digest, outcome);
  Notices notices;
  {
    MutexLock lock(&writer_);
    ActiveJob job = jobs_.EndRun(digest);
    LearnFrom(job, result);
    // Fails if the model was deleted before it was stored: then there is none.
    if (job.deleted && database_.models().Delete(digest).ok()) events_.LogDeletedResult(digest);
    job.record.start_count = 0;
    if (RunsAgain(job, result)) {
      job.again = job.deleted = job.yields = false;
      notices.push_back(jobs_.QueueAgain(std::move(job)));
    } else {
      if (result.verdict == Verdict::kOk && !job.deleted) FollowByTransfer(job);
      notices.push_back(Finish(std::move(job), result));
      ReleaseWaiting(digest, notices);
    }
    StartWhatFits(notices);
    for (Notice& news : jobs_.NewsOfWaiting()) notices.push_back(std::move(news));
  }
  TellAll(notices);
}

// Puts the model or the transfer into the database, without the writer's lock. An error in storing
// it is then the outcome of the job. While another process holds the database, the result of what
// may have been hours of work waits.
Outcome JobRuns::Store(const std::string& digest, const Outcome& outcome) {
  if (outcome.verdict != Verdict::kOk) return outcome;
  absl::Status stored;
  for (bool told = false; true; told = true) {
    const std::optional<ActiveJob> job = jobs_.Find(digest);
    const bool cancelled = told && job->record.state == v1::JOB_STATE_CANCELLED;
    if (job->deleted || cancelled) return {Verdict::kCancelled, {}, {}};
    stored = PutResult(job->record, outcome.model_file);
    if (stored.ok()) return outcome;
    if (ToErrorInfo(stored).reason() != "DATABASE_BUSY" || stops()) break;
    if (!told)
      settings_.log(absl::StrCat("the result of jobs/", digest, " waits: ", stored.message()));
  }
  return {Verdict::kCrashed, ToErrorInfo(stored), {}};
}

absl::Status JobRuns::PutResult(const JobRecord& job, const std::filesystem::path& file) {
  if (!job.transfer_of.empty()) {
    absl::Status stored = database_.transfers().PutFile(job.transfer_of, file).status();
    if (stored.ok()) events_.LogTransfer(job);
    return stored;
  }
  const absl::StatusOr<ModelSummary> model =
      database_.models().PutFile(job.digest, job.label, file);
  if (model.ok()) events_.LogModel(*model);
  return model.status();
}

bool JobRuns::stops() const {
  const MutexLock lock(&writer_);
  return stopping_;
}

bool JobRuns::RunsAgain(ActiveJob& job, const Outcome& result) const {
  if (job.again) return true;
  const bool cancelled = job.record.state == v1::JOB_STATE_CANCELLED;
  if (cancelled || job.deleted) return false;
  if (result.verdict == Verdict::kCancelled) return job.yields;
  if (result.crowded) {
    job.estimate_bytes = std::max(2 * job.estimate_bytes, result.peak_bytes * 3 / 2);
    return true;
  }
  if (result.killed && !std::exchange(job.was_killed, true)) {
    if (result.verdict == Verdict::kOutOfMemory) {
      job.estimate_bytes = std::max(2 * job.estimate_bytes, result.peak_bytes * 3 / 2);
    }
    settings_.log(absl::StrCat("jobs/", job.record.digest,
                               " is computed once more, because its process was killed"));
    return true;
  }
  const bool radiates = !job.record.transfer_of.empty();
  if (!radiates && DependsOnWay(result) && job.record.way + 1 < kWayCount) {
    ++job.record.way;
    settings_.log(absl::StrCat("jobs/", job.record.digest, " is computed another way after ",
                               result.error.message()));
    return true;
  }
  if (SameHints(job.request, *job.running)) return false;
  if (result.verdict == Verdict::kBadInput) return DependsOnHints(result.error.reason());
  return result.verdict == Verdict::kOk;
}

DecompositionQueue::Counts JobRuns::ended() {
  const MutexLock lock(&ended_mutex_);
  DecompositionQueue::Counts counts = ended_;
  counts.phases = phases_.uses();
  return counts;
}

void JobRuns::CountEnd(v1::JobState state) {
  const MutexLock lock(&ended_mutex_);
  ended_.succeeded += state == v1::JOB_STATE_SUCCEEDED ? 1 : 0;
  ended_.failed += state == v1::JOB_STATE_FAILED ? 1 : 0;
  ended_.cancelled += state == v1::JOB_STATE_CANCELLED ? 1 : 0;
}

Notice JobRuns::Finish(ActiveJob job, const Outcome& result) {
  JobRecord& record = job.record;
  record.state = StateOf(result.verdict);
  CountEnd(record.state);
  record.remembered = IsDeterministic(result);
  if (record.state == v1::JOB_STATE_FAILED) {
    record.error = result.error;
    events_.LogFailure(record, job.client);
  }
  // If the end cannot be stored, the row still says queued, and the next start of the daemon ends
  // the job.
  if (!job.deleted) database_.jobs().Put(record).IgnoreError();
  return jobs_.Remove(record.digest, ToJob(record));
}

void JobRuns::LearnFrom(ActiveJob& job, const Outcome& result) {
  job.record.peak_bytes = std::max(job.record.peak_bytes, result.peak_bytes);
  const double run_s = std::chrono::duration<double>(clock_.Monotonic() - job.started).count();
  mean_run_s_ += kWeightOfNewestRun * (run_s - mean_run_s_);
  const bool tells = result.verdict == Verdict::kOk && result.peak_bytes > 0;
  if (!tells || !job.record.transfer_of.empty()) return;
  const double correction = jobs_.Learn(job.guess_bytes, result.peak_bytes);
  database_.jobs().PutFact(kCorrectionFact, absl::StrCat(correction)).IgnoreError();
}

}  // namespace carillon
