// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/queue_core.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/decomposition/decomposition_request.h"

namespace carillon {
namespace {

// Eigenvalues go to the worker as decimals of its own units and come back: not the last bits.
constexpr double kRelativeTolerance = 1e-9;

v1::Job ToJob(const JobRecord& record) {
  v1::Job job;
  job.set_name(absl::StrCat("jobs/", record.digest));
  job.set_modal_model(absl::StrCat("modalModels/", record.digest));
  job.set_state(record.state);
  if (record.state == v1::JOB_STATE_FAILED) *job.mutable_error() = record.error;
  job.set_label(record.label);
  return job;
}

absl::Status NotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "JOB_NOT_FOUND",
                 absl::StrCat("no job is named jobs/", digest, ": create the modal model again"));
}

absl::Status QueueFull(size_t count) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "QUEUE_FULL",
      absl::StrCat(count, " decompositions wait already: try again when some have ended"));
}

bool SameHints(const v1::CreateModalModelRequest& a, const v1::CreateModalModelRequest& b) {
  return WantedEigenvalue(a) == WantedEigenvalue(b) &&
         UnitEigenvalue(a, a.min_frequency_hz()) == UnitEigenvalue(b, b.min_frequency_hz());
}

// Whether a refusal has to do with the band, so that other hints may have other luck.
bool DependsOnHints(const std::string& reason) {
  constexpr std::array kReasons = {"NO_MODE_IN_BAND", "TOO_MANY_MODES", "VERIFICATION_FAILED"};
  return std::ranges::find(kReasons, reason) != kReasons.end();
}

absl::StatusOr<v1::CreateModalModelRequest> ParseRequest(const JobRecord& record) {
  v1::CreateModalModelRequest request;
  if (request.ParseFromString(record.request)) return request;
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                 absl::StrCat("jobs/", record.digest, " cannot be read: create its model again"));
}

bool WouldFailAgain(const JobRecord& record, const v1::CreateModalModelRequest& request) {
  if (record.state != v1::JOB_STATE_FAILED || !record.remembered) return false;
  const auto refused = ParseRequest(record);
  return !DependsOnHints(record.error.reason()) || (refused.ok() && SameHints(*refused, request));
}

v1::JobState StateOf(Verdict verdict) {
  if (verdict == Verdict::kOk) return v1::JOB_STATE_SUCCEEDED;
  return verdict == Verdict::kCancelled ? v1::JOB_STATE_CANCELLED : v1::JOB_STATE_FAILED;
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
  MutexLock lock(&mutex_);
  for (JobRecord record : *records) {
    if (record.damaged) {
      settings_.log(record.error.message());
      if (absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
      continue;
    }
    auto request = ParseRequest(record);
    const absl::StatusOr<bool> satisfied =
        request.ok() ? IsSatisfied(std::nullopt, record.digest, *request) : request.status();
    if (satisfied.ok() && !*satisfied) {
      Enqueue(std::move(record), *std::move(request));
      continue;
    }
    // The daemon died between storing the model and saying so, or the row is damaged.
    record.state = satisfied.ok() ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_FAILED;
    if (!satisfied.ok()) record.error = ToErrorInfo(satisfied.status());
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
    if (queued_.size() >= settings_.max_queued_count) return QueueFull(queued_.size());
  }
  JobRecord record{.digest = digest,
                   .request = request.SerializeAsString(),
                   .label = request.label(),
                   .state = *satisfied ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_QUEUED,
                   .created_unix_ms = clock_.UnixMs()};
  if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
  if (*satisfied) return ToJob(record);
  Enqueue(std::move(record), request);
  StartWhatFits(notices);
  return FindJob(digest);
}

// A waiting or running job is told to go as far as the farthest request wants.
absl::StatusOr<v1::Job> QueueCore::SubmitAgain(Active& active,
                                               const v1::CreateModalModelRequest& request) {
  const bool wanted_no_more = active.record.state == v1::JOB_STATE_CANCELLED || active.deleted;
  const bool farther = WantedEigenvalue(request) > WantedEigenvalue(active.request);
  if (!wanted_no_more && !farther) return ActiveJob(active);
  JobRecord record = active.record;
  record.state = v1::JOB_STATE_QUEUED;
  record.request = request.SerializeAsString();
  if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
  active.record = std::move(record);
  active.request = request;
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

void QueueCore::Enqueue(JobRecord record, v1::CreateModalModelRequest request) {
  const std::string digest = record.digest;
  record.state = v1::JOB_STATE_QUEUED;
  Active active;
  active.record = std::move(record);
  active.request = std::move(request);
  active_.emplace(digest, std::move(active));
  queued_.push_back(digest);
}

void QueueCore::StartWhatFits(Notices& notices) {
  while (!stopping_ && !queued_.empty() && running_count_ < executor_->worker_count()) {
    Active& active = active_.at(queued_.front());
    queued_.pop_front();
    ++running_count_;
    active.running = active.request;
    active.progress.Clear();
    executor_->Start(MakeTask(active));
    notices.push_back(Announce(active));
  }
}

DecompositionTask QueueCore::MakeTask(const Active& active) {
  const std::string& digest = active.record.digest;
  return {.digest = digest,
          .request = active.request,
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
    // Deleted while it was being stored. It may not have come that far: then there is none.
    if (active.deleted) database_.models().Delete(digest).IgnoreError();
    if (RunAgain(active, result)) {
      active.running.reset();
      active.again = active.deleted = false;
      queued_.push_back(digest);
      notices.push_back(Announce(active));
    } else {
      JobRecord record = active.record;
      record.state = StateOf(result.verdict);
      record.remembered = result.verdict == Verdict::kBadInput;
      if (record.state == v1::JOB_STATE_FAILED) record.error = result.error;
      // Where even this cannot be written, the row still says queued, and the next start of the
      // daemon puts it right.
      if (!active.deleted) database_.jobs().Put(record).IgnoreError();
      notices.push_back({std::move(active.watchers), ToJob(record), ++version_});
      active_.erase(digest);
    }
    StartWhatFits(notices);
  }
  TellAll(notices);
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

bool QueueCore::RunAgain(const Active& active, const Outcome& outcome) const {
  if (active.again) return true;
  if (active.deleted || SameHints(active.request, *active.running)) return false;
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
  Notice notice;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&mutex_);
    const auto found = active_.find(digest);
    if (found == active_.end()) return FindJob(digest);
    Active& active = found->second;
    JobRecord record = active.record;
    record.state = v1::JOB_STATE_CANCELLED;
    if (const absl::Status status = database_.jobs().Put(record); !status.ok()) return status;
    active.record = std::move(record);
    active.again = false;
    if (active.running.has_value()) {
      if (!stopping_) executor_->Cancel(digest);
      return ActiveJob(active);
    }
    job = ToJob(active.record);
    notice = {std::move(active.watchers), *job, ++version_};
    std::erase(queued_, digest);
    active_.erase(found);
  }
  notice.Tell();
  return job;
}

absl::Status QueueCore::DeleteModel(const std::string& digest) {
  Notice notice;
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
    notice = {std::move(active.watchers), ToJob(active.record), ++version_};
    std::erase(queued_, digest);
    active_.erase(found);
  }
  notice.Tell();
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
