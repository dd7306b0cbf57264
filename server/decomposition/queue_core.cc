// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/queue_core.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/decomposition/coarse_request.h"
#include "server/decomposition/decomposition_request.h"
#include "server/decomposition/job_rules.h"
#include "server/decomposition/worker_command.h"

namespace carillon {
namespace {

// Eigenvalues go to the worker as decimals of its own units and come back: not the last bits.
constexpr double kRelativeTolerance = 1e-9;

// A daemon that was killed so often under one job may have been killed by it.
constexpr uint32_t kMostStarts = 10;
constexpr char kCorrectionFact[] = "memory_correction";

absl::Status NotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "JOB_NOT_FOUND",
                 absl::StrCat("no job is named jobs/", digest, ": create the modal model again"));
}

absl::Status QueueFull(size_t count, double retry_after_s) {
  const int64_t seconds = std::max<int64_t>(1, std::llround(retry_after_s));
  absl::Status status =
      Refusal(absl::StatusCode::kResourceExhausted, "QUEUE_FULL",
              absl::StrCat(count, " decompositions wait already: try again in ", seconds, " s"));
  AddFigure(status, "retry_after_s", absl::StrCat(seconds));
  return status;
}

void TellAll(const std::vector<Notice>& notices) {
  for (const Notice& notice : notices) notice.Tell();
}

}  // namespace

absl::Status QueueCore::TakeUp() {
  const auto records = database_.jobs().Unfinished();
  if (!records.ok()) return records.status();
  Notices notices;  // nobody watches yet
  database_.models().ListenToQuarantine(
      [this](const std::string& digest, const absl::Status& why) { OnQuarantine(digest, why); });
  const auto correction = database_.jobs().Fact(kCorrectionFact);
  double factor = 1;
  if (correction.ok() && correction->has_value()) {
    if (!absl::SimpleAtod(**correction, &factor)) factor = 1;
  }
  MutexLock lock(&mutex_);
  experience_ = MemoryExperience(factor);
  for (JobRecord record : *records) {
    if (active_.contains(record.digest)) continue;  // wanted by one before it
    if (record.damaged) {
      settings_.log(record.error.message());
      if (absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
      continue;
    }
    auto request = ParseRequest(record);
    const absl::StatusOr<bool> satisfied =
        request.ok() ? IsSatisfied(std::nullopt, record.digest, *request) : request.status();
    if (satisfied.ok() && !*satisfied && record.start_count < kMostStarts) {
      std::string coarse = StartCoarse(record.digest, *request, notices);
      Enqueue(std::move(record), *std::move(request), std::move(coarse));
      continue;
    }
    if (satisfied.ok() && !*satisfied) {
      record.state = v1::JOB_STATE_FAILED;
      record.error = GaveUp(std::exchange(record.start_count, 0));
      settings_.log(absl::StrCat("jobs/", record.digest, ": ", record.error.message()));
      if (absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
      continue;
    }
    // The daemon died between storing the model and saying so, or the row is damaged.
    record.state = satisfied.ok() ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_FAILED;
    if (!satisfied.ok()) record.error = ToErrorInfo(satisfied.status());
    record.start_count = 0;
    if (absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
  }
  StartWhatFits(notices);
  return absl::OkStatus();
}

void QueueCore::Stop() {
  database_.models().ListenToQuarantine(nullptr);
  {
    MutexLock lock(&mutex_);
    stopping_ = true;
    // These ends are the daemon's doing, not the jobs'.
    for (auto& [digest, active] : active_) {
      if (!active.running.has_value() || active.record.start_count == 0) continue;
      --active.record.start_count;
      if (!active.deleted) database_.jobs().Put(active.record).IgnoreError();
    }
  }
  executor_.reset();
}

absl::StatusOr<v1::Job> QueueCore::Submit(const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<v1::CreateModalModelRequest> resolved = ResolveRequest(request);
  if (!resolved.ok()) return resolved.status();
  const std::string digest = RequestDigest(*resolved);
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&mutex_);
    const auto active = active_.find(digest);
    job = active == active_.end() ? SubmitNew(digest, *resolved, notices)
                                  : SubmitAgain(active->second, *resolved);
  }
  TellAll(notices);
  return job;
}

absl::StatusOr<v1::Job> QueueCore::SubmitNew(const std::string& digest,
                                             const v1::CreateModalModelRequest& request,
                                             Notices& notices) {
  const absl::StatusOr<std::optional<JobRecord>> known = database_.jobs().Find(digest);
  if (!known.ok()) return known.status();
  const absl::StatusOr<bool> satisfied = IsSatisfied(*known, digest, request);
  if (!satisfied.ok()) return satisfied.status();
  if (known->has_value() && (*satisfied ? (*known)->state == v1::JOB_STATE_SUCCEEDED
                                        : WouldFailAgain(**known, request))) {
    // As it stands: its request tells how far the model was computed.
    return ToJob(**known);
  }
  if (!*satisfied) {
    const auto mesh = database_.meshes().Find(request.mesh_digest());
    if (!mesh.ok()) return mesh.status();
    if (queued_.size() >= settings_.max_queued_count) {
      return QueueFull(queued_.size(), mean_run_s_ / executor_->worker_count());
    }
  }
  // Before the job itself is written down: whoever takes that up finds this one in the queue.
  std::string coarse = *satisfied ? "" : StartCoarse(digest, request, notices);
  JobRecord record{.digest = digest,
                   .request = request.SerializeAsString(),
                   .label = request.label(),
                   .state = *satisfied ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_QUEUED,
                   .created_unix_ms = clock_.UnixMs(),
                   .priority = request.priority()};
  if (known->has_value()) record.peak_bytes = (*known)->peak_bytes;
  if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
  if (*satisfied) return ToJob(record);
  Enqueue(std::move(record), request, std::move(coarse));
  StartWhatFits(notices);
  return FindJob(digest);
}

// The job of the coarse model that the request wants first, where it has not ended yet; empty: none
// is to be waited for. What cannot be had coarsely is had finely only.
std::string QueueCore::StartCoarse(const std::string& digest,
                                   const v1::CreateModalModelRequest& request, Notices& notices) {
  if (!request.coarse_first() || database_.models().Summary(digest).ok()) return "";
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  const auto coarse = CoarseRequest(request, mesh.ok() ? mesh->byte_count : 0);
  if (!coarse.has_value()) return "";
  std::string coarse_digest = RequestDigest(*coarse);
  if (!active_.contains(coarse_digest)) {
    SubmitNew(coarse_digest, *coarse, notices).status().IgnoreError();
  }
  if (active_.contains(coarse_digest)) return coarse_digest;
  database_.models().CopyIfAbsent(coarse_digest, digest, request.label()).IgnoreError();
  return "";
}

// The coarse model's job has ended, however it did: those that waited for it have their turn.
void QueueCore::ReleaseWaiting(const std::string& coarse, Notices& notices) {
  for (auto& [digest, active] : active_) {
    if (active.waits_for != coarse) continue;
    active.waits_for.clear();
    queued_.insert(PlaceOf(active));
    // Where there is none, nothing can be copied; the wait is over all the same.
    database_.models().CopyIfAbsent(coarse, digest, active.record.label).IgnoreError();
    active.coarse_ready = HasCoarse(digest, active.request);
    notices.push_back(Announce(active));
  }
}

bool QueueCore::HasCoarse(const std::string& digest, const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<ModelSummary> model = database_.models().Summary(digest);
  return model.ok() && IsCoarseOf(model->header, request);
}

// A waiting or running job is told to go as far as the farthest request wants.
absl::StatusOr<v1::Job> QueueCore::SubmitAgain(Active& active,
                                               const v1::CreateModalModelRequest& request) {
  const bool wanted_no_more = active.record.state == v1::JOB_STATE_CANCELLED || active.deleted;
  const bool farther = WantedEigenvalue(request) > WantedEigenvalue(active.request);
  const bool sooner = request.priority() > active.record.priority;
  if (!wanted_no_more && !farther && !sooner) return ActiveJob(active);
  JobRecord record = active.record;
  record.state = v1::JOB_STATE_QUEUED;
  record.priority = std::max(record.priority, request.priority());
  if (wanted_no_more || farther) record.request = request.SerializeAsString();
  if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
  const bool waits = queued_.erase(PlaceOf(active)) > 0;
  active.record = std::move(record);
  if (waits) queued_.insert(PlaceOf(active));
  if (wanted_no_more || farther) active.request = request;
  active.again = active.again || wanted_no_more;
  return ActiveJob(active);
}

// Whether the stored model goes as far as wanted, or as far as a job that wanted as much could go.
absl::StatusOr<bool> QueueCore::IsSatisfied(const std::optional<JobRecord>& record,
                                            const std::string& digest,
                                            const v1::CreateModalModelRequest& request) {
  const absl::StatusOr<ModelSummary> model = database_.models().Summary(digest);
  if (absl::IsNotFound(model.status()) || absl::IsDataLoss(model.status())) return false;
  if (!model.ok()) return model.status();
  if (IsCoarseOf(model->header, request)) return false;
  const double wanted = WantedEigenvalue(request) * (1 - kRelativeTolerance);
  if (model->header.complete_to_eigenvalue() >= wanted) return true;
  if (!record.has_value() || record->state != v1::JOB_STATE_SUCCEEDED) return false;
  const auto ran = ParseRequest(*record);
  return ran.ok() && WantedEigenvalue(*ran) >= wanted;
}

void QueueCore::OnQuarantine(const std::string& digest, const absl::Status& why) {
  Notices notices;
  bool again = false;
  {
    MutexLock lock(&mutex_);
    again = ComputeAgain(digest, notices);
  }
  settings_.log(absl::StrCat(why.message(), again ? "; it is computed again" : "; it has no job"));
  TellAll(notices);
}

// Whether the model of that name is being computed now.
bool QueueCore::ComputeAgain(const std::string& digest, Notices& notices) {
  if (active_.contains(digest)) return true;
  auto record = database_.jobs().Find(digest);
  if (!record.ok() || !record->has_value() || (*record)->damaged) return false;
  auto request = ParseRequest(**record);
  if (!request.ok()) return false;
  (*record)->state = v1::JOB_STATE_QUEUED;
  if (!database_.jobs().Put(**record).ok()) return false;
  Enqueue(**std::move(record), *std::move(request));
  StartWhatFits(notices);
  return true;
}

void QueueCore::Enqueue(JobRecord record, v1::CreateModalModelRequest request,
                        std::string waits_for) {
  const std::string digest = record.digest;
  record.state = v1::JOB_STATE_QUEUED;
  Active active;
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  active.guess_bytes = MemoryOfNodes(GuessNodeCount(request, mesh.ok() ? mesh->byte_count : 0));
  active.estimate_bytes =
      record.peak_bytes > 0 ? record.peak_bytes : experience_.Corrected(active.guess_bytes);
  active.record = std::move(record);
  active.request = std::move(request);
  active.waits_for = std::move(waits_for);
  active.coarse_ready = HasCoarse(digest, active.request);
  Requeue(active_.emplace(digest, std::move(active)).first->second);
}

void QueueCore::Requeue(Active& active) {
  active.number = ++last_number_;
  if (active.waits_for.empty()) queued_.insert(PlaceOf(active));
}

QueueCore::Place QueueCore::PlaceOf(const Active& active) {
  return {-active.record.priority, active.number, active.record.digest};
}

// The first in the queue starts where a worker and the memory for it are free. Nobody overtakes it:
// else small ones might keep a large one waiting for ever.
void QueueCore::StartWhatFits(Notices& notices) {
  while (!stopping_ && !queued_.empty() && running_count_ < executor_->worker_count()) {
    Active& active = active_.at(std::get<std::string>(*queued_.begin()));
    const bool fits = reserved_bytes_ + active.estimate_bytes <= executor_->memory_budget_bytes();
    if (!fits && running_count_ > 0) return;
    queued_.erase(queued_.begin());
    ++running_count_;
    Reserve(active, active.estimate_bytes);
    active.running = active.request;
    active.started = clock_.Monotonic();
    active.progress.Clear();
    ++active.record.start_count;
    // Where it cannot be counted, nothing worse follows than one start more after a kill.
    database_.jobs().Put(active.record).IgnoreError();
    executor_->Start(MakeTask(active));
    notices.push_back(Announce(active));
  }
}

void QueueCore::Reserve(Active& active, uint64_t bytes) {
  reserved_bytes_ += bytes - active.reserved_bytes;
  active.reserved_bytes = bytes;
}

DecompositionTask QueueCore::MakeTask(const Active& active) {
  const std::string& digest = active.record.digest;
  return {.digest = digest,
          .request = active.request,
          .way = active.record.way,
          .estimate_bytes = active.estimate_bytes,
          .write_mesh =
              [this, mesh = active.request.mesh_digest()](const std::filesystem::path& file) {
                return database_.meshes().WriteFile(mesh, file);
              },
          .on_progress = [this, digest](const v1::Progress& p) { OnProgress(digest, p); },
          .on_end = [this, digest](const Outcome& outcome) { OnEnd(digest, outcome); }};
}

void QueueCore::OnProgress(const std::string& digest, const v1::Progress& progress) {
  Notice notice;
  {
    MutexLock lock(&mutex_);
    Active& active = active_.at(digest);
    // Once the mesh is there, its nodes tell better than its file what is to come.
    if (active.progress.node_count() == 0 && progress.node_count() > 0) {
      active.guess_bytes = MemoryOfNodes(progress.node_count());
      active.estimate_bytes = experience_.Corrected(active.guess_bytes);
      Reserve(active, active.estimate_bytes);
    }
    active.progress = progress;
    notice = Announce(active);
  }
  notice.Tell();
}

void QueueCore::OnEnd(const std::string& digest, const Outcome& outcome) {
  const Outcome result = Store(digest, outcome);
  Notices notices;
  {
    MutexLock lock(&mutex_);
    --running_count_;
    Active& active = active_.at(digest);
    Reserve(active, 0);
    LearnFrom(active, result);
    // Deleted while it was being stored. It may not have come that far: then there is none.
    if (active.deleted) database_.models().Delete(digest).IgnoreError();
    active.record.start_count = 0;
    if (RunAgain(active, result)) {
      active.running.reset();
      active.again = active.deleted = false;
      Requeue(active);
      notices.push_back(Announce(active));
    } else {
      notices.push_back(Finish(active, result));
      ReleaseWaiting(digest, notices);
    }
    StartWhatFits(notices);
  }
  TellAll(notices);
}

Notice QueueCore::Finish(Active& active, const Outcome& result) {
  JobRecord record = active.record;
  record.state = StateOf(result.verdict);
  record.remembered = IsDeterministic(result);
  if (record.state == v1::JOB_STATE_FAILED) record.error = result.error;
  // Where even this cannot be written, the row still says queued, and the next start of the daemon
  // puts it right.
  if (!active.deleted) database_.jobs().Put(record).IgnoreError();
  Notice notice{std::move(active.watchers), ToJob(record), ++version_};
  active_.erase(record.digest);
  return notice;
}

void QueueCore::LearnFrom(Active& active, const Outcome& result) {
  active.record.peak_bytes = std::max(active.record.peak_bytes, result.peak_bytes);
  const double run_s = std::chrono::duration<double>(clock_.Monotonic() - active.started).count();
  mean_run_s_ += 0.1 * (run_s - mean_run_s_);
  if (result.verdict != Verdict::kOk || result.peak_bytes == 0) return;
  experience_.Learn(active.guess_bytes, result.peak_bytes);
  database_.jobs().PutFact(kCorrectionFact, absl::StrCat(experience_.correction())).IgnoreError();
}

// The model goes into the database; where it does not, that is the outcome.
Outcome QueueCore::Store(const std::string& digest, const Outcome& outcome) {
  if (outcome.verdict != Verdict::kOk) return outcome;
  std::string label;
  {
    MutexLock lock(&mutex_);
    const Active& active = active_.at(digest);
    if (active.deleted) return {Verdict::kCancelled, {}, {}};
    label = active.record.label;
  }
  const auto stored = database_.models().PutFile(digest, label, outcome.model_file);
  if (stored.ok()) return outcome;
  return {Verdict::kCrashed, ToErrorInfo(stored.status()), {}};
}

bool QueueCore::RunAgain(Active& active, const Outcome& outcome) {
  if (active.again) return true;
  if (active.deleted || outcome.verdict == Verdict::kCancelled) return false;
  if (outcome.crowded) {
    active.estimate_bytes = std::max(2 * active.estimate_bytes, outcome.peak_bytes * 3 / 2);
    return true;
  }
  if (DependsOnWay(outcome) && active.record.way + 1 < kWayCount) {
    ++active.record.way;
    settings_.log(absl::StrCat("jobs/", active.record.digest, " is tried another way after ",
                               outcome.error.message()));
    return true;
  }
  if (SameHints(active.request, *active.running)) return false;
  if (outcome.verdict == Verdict::kBadInput) return DependsOnHints(outcome.error.reason());
  return outcome.verdict == Verdict::kOk;
}

absl::StatusOr<v1::Job> QueueCore::Get(const std::string& digest) {
  MutexLock lock(&mutex_);
  return FindJob(digest);
}

absl::StatusOr<DecompositionJobPage> QueueCore::List(int page_size, const std::string& page_token) {
  MutexLock lock(&mutex_);
  const absl::StatusOr<JobPage> records = database_.jobs().List(page_size, page_token);
  if (!records.ok()) return records.status();
  DecompositionJobPage page;
  page.next_page_token = records->next_page_token;
  for (const JobRecord& record : records->jobs) {
    const auto active = active_.find(record.digest);
    page.jobs.push_back(active == active_.end() ? ToJob(record) : ActiveJob(active->second));
  }
  return page;
}

absl::StatusOr<v1::Job> QueueCore::Cancel(const std::string& digest) {
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&mutex_);
    const auto found = active_.find(digest);
    if (found == active_.end()) return FindJob(digest);
    Active& active = found->second;
    // Before it is written down, which may take a while.
    if (active.running.has_value() && !stopping_) executor_->Cancel(digest);
    JobRecord record = active.record;
    record.state = v1::JOB_STATE_CANCELLED;
    if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
    active.record = std::move(record);
    active.again = false;
    if (active.running.has_value()) return ActiveJob(active);
    job = ToJob(active.record);
    notices.push_back({std::move(active.watchers), *job, ++version_});
    queued_.erase(PlaceOf(active));
    active_.erase(found);
    ReleaseWaiting(digest, notices);
    StartWhatFits(notices);
  }
  TellAll(notices);
  return job;
}

absl::Status QueueCore::DeleteModel(const std::string& digest) {
  Notices notices;
  {
    MutexLock lock(&mutex_);
    if (absl::Status status = database_.models().Delete(digest); !status.ok()) return status;
    const auto found = active_.find(digest);
    if (found == active_.end()) return absl::OkStatus();
    Active& active = found->second;
    active.record.state = v1::JOB_STATE_CANCELLED;
    active.deleted = true;
    active.again = false;
    if (active.running.has_value()) {
      if (!stopping_) executor_->Cancel(digest);
      return absl::OkStatus();
    }
    notices.push_back({std::move(active.watchers), ToJob(active.record), ++version_});
    queued_.erase(PlaceOf(active));
    active_.erase(found);
    ReleaseWaiting(digest, notices);
    StartWhatFits(notices);
  }
  TellAll(notices);
  return absl::OkStatus();
}

absl::Status QueueCore::Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  Notice notice;
  {
    MutexLock lock(&mutex_);
    const absl::StatusOr<v1::Job> job = FindJob(digest);
    if (!job.ok()) return job.status();
    if (const auto active = active_.find(digest); active != active_.end()) {
      active->second.watchers.push_back(watcher);
    }
    notice = {{watcher}, *job, ++version_};
  }
  notice.Tell();
  return absl::OkStatus();
}

void QueueCore::Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  MutexLock lock(&mutex_);
  const auto active = active_.find(digest);
  if (active != active_.end()) std::erase(active->second.watchers, watcher);
}

Notice QueueCore::Announce(const Active& active) {
  return {active.watchers, ActiveJob(active), ++version_};
}

v1::Job QueueCore::ActiveJob(const Active& active) const {
  v1::Job job = ToJob(active.record);
  job.set_state(active.running.has_value() ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_QUEUED);
  job.set_memory_bytes(std::max(active.record.peak_bytes, active.estimate_bytes));
  job.set_coarse_ready(active.coarse_ready);
  if (active.running.has_value()) *job.mutable_progress() = active.progress;
  return job;
}

absl::StatusOr<v1::Job> QueueCore::FindJob(const std::string& digest) {
  const auto active = active_.find(digest);
  if (active != active_.end()) return ActiveJob(active->second);
  const absl::StatusOr<std::optional<JobRecord>> record = database_.jobs().Find(digest);
  if (!record.ok()) return record.status();
  if (!record->has_value()) return NotFound(digest);
  return ToJob(**record);
}

}  // namespace carillon
