// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_runs.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/job/job_rules.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/job/stored_model.h"
#include "server/decomposition/job/wanted_job.h"

namespace carillon {
namespace {

constexpr double kWeightOfNewestRun = 0.1;
// A transfer holds the model's shapes as double numbers, and the fields on surfaces of some ten
// thousand vertices.
constexpr uint64_t kTransferBytes = uint64_t{256} << 20U;
constexpr uint64_t kTransferTimesModel = 4;

constexpr std::chrono::milliseconds kPauseBeforeStoring(250);

// Whether a write fails only as long as the disk is full or another process holds the database.
bool IsStoredLater(const absl::Status& status) {
  const std::string reason = ToErrorInfo(status).reason();
  return reason == "DATABASE_FULL" || reason == "DATABASE_BUSY";
}

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
                 ActiveJobs& jobs, JobJournal& journal, JobEvents& events,
                 const QueueSettings& settings)
    : database_(database),
      clock_(clock),
      jobs_(jobs),
      journal_(journal),
      events_(events),
      settings_(settings),
      executor_(std::move(executor)),
      worker_count_(executor_->worker_count()) {}

void JobRuns::Stop() {
  {
    MutexLock lock(&writer_);
    stopping_ = true;
    // The daemon ends these runs; the jobs are not to blame, so the starts do not count.
    for (ActiveJob& job : jobs_.Select([](const ActiveJob& job) { return job.runs(); })) {
      if (job.deleted() || job.record.start_count == 0) continue;
      --job.record.start_count;
      journal_.Note(job.record);
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

// The jobs of the transfers are stored before the end of the model's, so that a daemon that is
// killed in between finds them. A model that replaces one with fewer modes, for instance for
// another material, needs the transfers that this one had, too.
absl::Status JobRuns::FollowByTransfers(const ActiveJob& model, const Lost& lost) {
  if (!settings_.transfers || !model.record.transfer_of.empty()) return absl::OkStatus();
  if (!model.given.without_transfer()) {
    RETURN_IF_ERROR(FollowByTransfer(model, WantedTransfer(model.record.digest, model.given)));
  }
  for (const v1::TransferHeader& transfer : lost.transfers) {
    RETURN_IF_ERROR(
        FollowByTransfer(model, WantedTransfer(model.record.digest, transfer, model.record.label)));
  }
  return absl::OkStatus();
}

absl::Status JobRuns::FollowByTransfer(const ActiveJob& model, WantedJob wanted) {
  if (const std::optional<ActiveJob> active = jobs_.Find(wanted.digest)) {
    // Its run, if there is one, is on an older revision of the model.
    const ModelReplaced replaced{model.wishes};
    journal_.Note(Transition(*active, replaced).job.record, model.wishes.Wanting());
    jobs_.Apply(wanted.digest, replaced);
    return absl::OkStatus();
  }
  JobRecord record = NewRecord(wanted, clock_.UnixMs());
  RETURN_IF_ERROR(journal_.Put(record, model.wishes.Wanting()));
  JobOrigin origin{.client = model.client};
  origin.wishes.Add(model.wishes);
  Enqueue(std::move(record), std::move(wanted.request), std::move(origin));
  return absl::OkStatus();
}

std::vector<v1::TransferHeader> JobRuns::TransfersOf(const std::string& model) {
  std::vector<v1::TransferHeader> headers;
  const auto stored = database_.transfers().List(model);
  if (!stored.ok()) return headers;
  headers.reserve(stored->size());
  for (const TransferSummary& transfer : *stored) headers.push_back(transfer.header);
  return headers;
}

void JobRuns::StartWhatFits(Notices& notices) {
  while (!stopping_) {
    const std::optional<ActiveJob> job = jobs_.BeginRun(clock_);
    if (!job.has_value()) break;
    journal_.Note(job->record);
    executor_->Start(MakeTask(*job));
    notices.push_back(jobs_.AnnounceRun(job->record.digest));
  }
  if (stopping_) return;
  for (const std::string& digest : jobs_.BeginYielding()) executor_->Cancel(digest);
}

void JobRuns::StopRun(const std::string& digest) {
  if (!stopping_) executor_->Cancel(digest);
}

// Gives the jobs that wait for the coarse model a copy of it. A copy may take a while, so it is
// made before the lock is taken in which the jobs go on.
void JobRuns::CopyToWaiting(const std::string& coarse) {
  const std::vector<ActiveJob> waiting =
      jobs_.Select([&coarse](const ActiveJob& job) { return job.waits_for == coarse; });
  if (waiting.empty() || !database_.models().Summary(coarse).ok()) return;
  for (const ActiveJob& job : waiting) {
    journal_.NoteCoarseModel(coarse, job.record.digest, job.record.label);
  }
}

void JobRuns::ReleaseWaiting(const std::string& coarse, Notices& notices) {
  for (const ActiveJob& job :
       jobs_.Select([&coarse](const ActiveJob& job) { return job.waits_for == coarse; })) {
    const std::string& digest = job.record.digest;
    const bool copied = HasCoarseModel(database_.models(), digest, job.request);
    notices.push_back(jobs_.Apply(digest, CoarseEnded{copied}));
  }
}

void JobRuns::GoOnAfter(const std::string& ended, Notices& notices) {
  ReleaseWaiting(ended, notices);
  StartWhatFits(notices);
  for (Notice& news : jobs_.NewsOfWaiting()) notices.push_back(std::move(news));
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
  Lost lost{.transfers = TransfersOf(digest)};
  const RunEnded end{Store(digest, outcome)};
  if (!TransfersOf(digest).empty()) lost.transfers.clear();  // the model has stayed the same
  if (end.outcome.verdict == Verdict::kOk) CopyToWaiting(digest);
  absl::Status stored;
  for (bool told = false; !told || !stored.ok(); told = true) {
    if (told) std::this_thread::sleep_for(kPauseBeforeStoring);
    Notices notices;
    {
      MutexLock lock(&writer_);
      stored = TryEnd(digest, end, lost, notices);
    }
    TellAll(notices);
    if (!told) events_.LogUnstored("job", digest, stored);
  }
}

// Returns why the end has to wait until it can be stored, or OK. `lost` is kept for the next
// attempt.
absl::Status JobRuns::TryEnd(const std::string& digest, const RunEnded& end, Lost& lost,
                             Notices& notices) {
  const bool succeeded = end.outcome.verdict == Verdict::kOk;
  const ActiveJob job = *jobs_.Find(digest);
  const JobStep step = Transition(job, end);
  const bool ends = step.action == JobAction::kEnd;
  if (ends && !job.deleted()) {
    absl::Status stored = StoreEnd(job, step.job.record, lost);
    if (IsStoredLater(stored) && !stopping_) return stored;
    events_.LogUnstored("job", digest, stored);
  }
  jobs_.EndRun(digest, succeeded ? end.outcome.peak_bytes : 0);
  if (succeeded && job.record.transfer_of.empty()) journal_.NoteExperience(jobs_.experience());
  const double run_s = std::chrono::duration<double>(clock_.Monotonic() - job.started).count();
  mean_run_s_ += kWeightOfNewestRun * (run_s - mean_run_s_);
  // Fails if the model was deleted before it was stored: then there is none.
  if (job.deleted() && database_.models().Delete(digest).ok()) events_.LogDeletedResult(digest);
  if (!step.note.empty()) settings_.log(step.note);
  if (ends) CountEnd(step.job);
  notices.push_back(jobs_.Apply(digest, end));
  if (ends) ReleaseWaiting(digest, notices);
  StartWhatFits(notices);
  for (Notice& news : jobs_.NewsOfWaiting()) notices.push_back(std::move(news));
  return absl::OkStatus();
}

// If the daemon stops before the end can be stored, the row still says queued, and the next start
// of the daemon ends the job.
absl::Status JobRuns::StoreEnd(const ActiveJob& job, const JobRecord& ended, Lost& lost) {
  if (ended.state == v1::JOB_STATE_SUCCEEDED && !lost.queued) {
    RETURN_IF_ERROR(FollowByTransfers(job, lost));
    lost.queued = true;
  }
  return journal_.Put(ended);
}

void JobRuns::CountEnd(const ActiveJob& job) {
  const v1::JobState state = job.record.state;
  if (state == v1::JOB_STATE_FAILED) events_.LogFailure(job.record, job.client);
  const MutexLock lock(&ended_mutex_);
  ended_.succeeded += state == v1::JOB_STATE_SUCCEEDED ? 1 : 0;
  ended_.failed += state == v1::JOB_STATE_FAILED ? 1 : 0;
  ended_.cancelled += state == v1::JOB_STATE_CANCELLED ? 1 : 0;
}

// Puts the model or the transfer into the database, without the writer's lock. An error in storing
// it is then the outcome of the job. While another process holds the database, or the disk is full,
// the result of what may have been hours of work waits.
Outcome JobRuns::Store(const std::string& digest, const Outcome& outcome) {
  if (outcome.verdict != Verdict::kOk) return outcome;
  absl::Status stored;
  for (bool told = false; true; told = true) {
    const std::optional<ActiveJob> job = jobs_.Find(digest);
    const bool cancelled = told && job->stage == JobStage::kCancelled;
    if (job->deleted() || cancelled) return {Verdict::kCancelled, {}, {}};
    stored = PutResult(job->record, outcome.model_file);
    if (stored.ok()) return outcome;
    if (!IsStoredLater(stored) || stops()) break;
    if (!told)
      settings_.log(absl::StrCat("the result of jobs/", digest, " waits: ", stored.message()));
    std::this_thread::sleep_for(kPauseBeforeStoring);
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

QueueCounts JobRuns::ended() {
  const MutexLock lock(&ended_mutex_);
  QueueCounts counts = ended_;
  counts.phases = phases_.uses();
  return counts;
}

}  // namespace carillon
