// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/queue_core.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/coarse_request.h"
#include "server/decomposition/decomposition_request.h"
#include "server/decomposition/job_rules.h"
#include "server/decomposition/memory_estimate.h"
#include "server/decomposition/stored_model.h"

namespace carillon {
namespace {

// A daemon that was killed this often while a job ran may have been killed because of the job.
constexpr uint32_t kMostStarts = 10;

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
  ASSIGN_OR_RETURN(const auto records, database_.jobs().Unfinished());
  Notices notices;  // nobody watches yet
  database_.models().ListenToQuarantine(
      [this](const std::string& digest, const absl::Status& why) { OnQuarantine(digest, why); });
  runs_.RecallExperience();
  MutexLock lock(&runs_.writer());
  for (const JobRecord& record : records) {
    // A coarse model's job may have been queued already, by the job that waits for it.
    if (jobs_.Contains(record.digest)) continue;
    RETURN_IF_ERROR(TakeUpJob(record, notices));
  }
  runs_.StartWhatFits(notices);
  return absl::OkStatus();
}

absl::Status QueueCore::TakeUpJob(JobRecord record, Notices& notices) {
  if (record.damaged) {
    settings_.log(record.error.message());
    return database_.jobs().Put(record);
  }
  auto request = ParseRequest(record);
  const absl::StatusOr<bool> satisfied =
      request.ok() ? IsSatisfied(database_.models(), record.digest, std::nullopt, *request)
                   : request.status();
  if (satisfied.ok() && !*satisfied && record.start_count < kMostStarts) {
    std::string coarse = StartCoarse(record.digest, *request, notices);
    Enqueue(std::move(record), *std::move(request), std::move(coarse));
    return absl::OkStatus();
  }
  const uint32_t start_count = std::exchange(record.start_count, 0);
  // A satisfied job has its model: the daemon was killed before it stored the job's end.
  record.state = satisfied.ok() && *satisfied ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_FAILED;
  if (!satisfied.ok()) record.error = ToErrorInfo(satisfied.status());
  if (satisfied.ok() && !*satisfied) {
    record.error = GaveUp(start_count);
    settings_.log(absl::StrCat("jobs/", record.digest, ": ", record.error.message()));
  }
  return database_.jobs().Put(record);
}

void QueueCore::Stop() {
  database_.models().ListenToQuarantine(nullptr);
  runs_.Stop();
}

absl::StatusOr<v1::Job> QueueCore::Submit(const v1::CreateModalModelRequest& request) {
  ASSIGN_OR_RETURN(const v1::CreateModalModelRequest resolved, ResolveRequest(request));
  const std::string digest = RequestDigest(resolved);
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&runs_.writer());
    const std::optional<ActiveJob> active = jobs_.Find(digest);
    job =
        active.has_value() ? SubmitAgain(*active, resolved) : SubmitNew(digest, resolved, notices);
  }
  TellAll(notices);
  return job;
}

absl::StatusOr<v1::Job> QueueCore::SubmitNew(const std::string& digest,
                                             const v1::CreateModalModelRequest& request,
                                             Notices& notices) {
  ASSIGN_OR_RETURN(const std::optional<JobRecord> known, database_.jobs().Find(digest));
  ASSIGN_OR_RETURN(const bool satisfied, IsSatisfied(database_.models(), digest, known, request));
  if (known.has_value() &&
      (satisfied ? known->state == v1::JOB_STATE_SUCCEEDED : WouldFailAgain(*known, request))) {
    // The record stays unchanged: its request tells how far the model was computed.
    return ToJob(*known);
  }
  if (!satisfied) {
    RETURN_IF_ERROR(CheckAcceptable(request));
  }
  // The coarse job is stored first. A daemon that takes up this job then finds the coarse one.
  std::string coarse = satisfied ? "" : StartCoarse(digest, request, notices);
  JobRecord record{.digest = digest,
                   .request = request.SerializeAsString(),
                   .label = request.label(),
                   .state = satisfied ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_QUEUED,
                   .created_unix_ms = clock_.UnixMs(),
                   .priority = request.priority()};
  if (known.has_value()) record.peak_bytes = known->peak_bytes;
  RETURN_IF_ERROR(database_.jobs().Put(record));
  if (satisfied) return ToJob(record);
  Enqueue(std::move(record), request, std::move(coarse));
  runs_.StartWhatFits(notices);
  return Get(digest);
}

absl::Status QueueCore::CheckAcceptable(const v1::CreateModalModelRequest& request) {
  RETURN_IF_ERROR(database_.meshes().Find(request.mesh_digest()).status());
  const size_t count = jobs_.queued_count();
  if (count < settings_.max_queued_count) return absl::OkStatus();
  return QueueFull(count, runs_.retry_after_s());
}

// The digest of the coarse model's job that the request has to wait for; empty if there is none. A
// request whose coarse model cannot be computed gets the fine one only.
std::string QueueCore::StartCoarse(const std::string& digest,
                                   const v1::CreateModalModelRequest& request, Notices& notices) {
  if (!request.coarse_first() || database_.models().Summary(digest).ok()) return "";
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  const auto coarse = CoarseRequest(request, mesh.ok() ? mesh->byte_count : 0);
  if (!coarse.has_value()) return "";
  std::string coarse_digest = RequestDigest(*coarse);
  if (!jobs_.Contains(coarse_digest)) {
    SubmitNew(coarse_digest, *coarse, notices).status().IgnoreError();
  }
  if (jobs_.Contains(coarse_digest)) return coarse_digest;
  database_.models().CopyIfAbsent(coarse_digest, digest, request.label()).IgnoreError();
  return "";
}

// A job that waits or runs serves all requests for its digest: it is extended up to the highest
// eigenvalue that any of them wants.
absl::StatusOr<v1::Job> QueueCore::SubmitAgain(const ActiveJob& active,
                                               const v1::CreateModalModelRequest& request) {
  const std::string& digest = active.record.digest;
  const bool wanted_no_more = active.record.state == v1::JOB_STATE_CANCELLED || active.deleted;
  const bool farther = WantedEigenvalue(request) > WantedEigenvalue(active.request);
  const bool sooner = request.priority() > active.record.priority;
  if (!wanted_no_more && !farther && !sooner) return Get(digest);
  JobRecord record = active.record;
  record.state = v1::JOB_STATE_QUEUED;
  record.priority = std::max(record.priority, request.priority());
  if (wanted_no_more || farther) record.request = request.SerializeAsString();
  RETURN_IF_ERROR(database_.jobs().Put(record));
  return jobs_
      .Change(digest,
              [&](ActiveJob& job) {
                job.record = std::move(record);
                if (wanted_no_more || farther) job.request = request;
                job.again = job.again || wanted_no_more;
              })
      .job;
}

void QueueCore::OnQuarantine(const std::string& digest, const absl::Status& why) {
  Notices notices;
  bool again = false;
  {
    MutexLock lock(&runs_.writer());
    again = ComputeAgain(digest, notices);
  }
  settings_.log(absl::StrCat(why.message(),
                             again ? "; the model is computed again" : "; the model has no job"));
  TellAll(notices);
}

// Whether the model of that digest is being computed when this returns.
bool QueueCore::ComputeAgain(const std::string& digest, Notices& notices) {
  if (jobs_.Contains(digest)) return true;
  auto record = database_.jobs().Find(digest);
  if (!record.ok() || !record->has_value() || (*record)->damaged) return false;
  auto request = ParseRequest(**record);
  if (!request.ok()) return false;
  (*record)->state = v1::JOB_STATE_QUEUED;
  if (!database_.jobs().Put(**record).ok()) return false;
  Enqueue(**std::move(record), *std::move(request));
  runs_.StartWhatFits(notices);
  return true;
}

void QueueCore::Enqueue(JobRecord record, v1::CreateModalModelRequest request,
                        std::string waits_for) {
  record.state = v1::JOB_STATE_QUEUED;
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  const uint64_t mesh_bytes = mesh.ok() ? mesh->byte_count : 0;
  const bool coarse_ready = HasCoarseModel(database_.models(), record.digest, request);
  const uint64_t guess_bytes = MemoryOfNodes(GuessNodeCount(request, mesh_bytes));
  jobs_.Add({.record = std::move(record),
             .request = std::move(request),
             .waits_for = std::move(waits_for),
             .coarse_ready = coarse_ready,
             .guess_bytes = guess_bytes});
}

absl::StatusOr<v1::Job> QueueCore::Get(const std::string& digest) {
  // The memory is read first, because a job leaves it only after its end is stored.
  if (auto active = jobs_.View(digest)) return *std::move(active);
  return FindStored(digest);
}

absl::StatusOr<DecompositionJobPage> QueueCore::List(int page_size, const std::string& page_token) {
  // The memory is read first: a job that a client has seen running is not listed as queued then.
  std::map<std::string, v1::Job> active = jobs_.ViewAll();
  ASSIGN_OR_RETURN(const JobPage records, database_.jobs().List(page_size, page_token));
  DecompositionJobPage page;
  page.next_page_token = records.next_page_token;
  for (const JobRecord& record : records.jobs) {
    const auto job = active.find(record.digest);
    page.jobs.push_back(job == active.end() ? ToJob(record) : std::move(job->second));
  }
  return page;
}

absl::StatusOr<v1::Job> QueueCore::Cancel(const std::string& digest) {
  Notices notices;
  JobRecord record;
  {
    MutexLock lock(&runs_.writer());
    const std::optional<ActiveJob> active = jobs_.Find(digest);
    if (!active.has_value()) return FindStored(digest);
    // The worker ends first, because the database may take a while.
    if (active->running.has_value()) runs_.Cancel(digest);
    record = active->record;
    record.state = v1::JOB_STATE_CANCELLED;
    RETURN_IF_ERROR(database_.jobs().Put(record));
    if (active->running.has_value()) {
      return jobs_
          .Change(digest,
                  [&](ActiveJob& job) {
                    job.record = record;
                    job.again = false;
                  })
          .job;
    }
    EndQueued(record, notices);
  }
  TellAll(notices);
  return ToJob(record);
}

absl::Status QueueCore::DeleteModel(const std::string& digest) {
  Notices notices;
  {
    MutexLock lock(&runs_.writer());
    RETURN_IF_ERROR(database_.models().Delete(digest));
    std::optional<ActiveJob> active = jobs_.Find(digest);
    if (!active.has_value()) return absl::OkStatus();
    active->record.state = v1::JOB_STATE_CANCELLED;
    if (!active->running.has_value()) {
      EndQueued(active->record, notices);
    } else {
      runs_.Cancel(digest);
      jobs_.Change(digest, [&](ActiveJob& job) {
        job.record.state = v1::JOB_STATE_CANCELLED;
        job.deleted = true;
        job.again = false;
      });
    }
  }
  TellAll(notices);
  return absl::OkStatus();
}

void QueueCore::EndQueued(const JobRecord& record, Notices& notices) {
  notices.push_back(jobs_.Remove(record.digest, ToJob(record)));
  runs_.ReleaseWaiting(record.digest, notices);
  runs_.StartWhatFits(notices);
}

absl::Status QueueCore::Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  // The watcher is registered before the database is read, so that it misses no change.
  Notice first = jobs_.Watch(digest, watcher);
  if (first.job.name().empty()) {
    const absl::StatusOr<v1::Job> stored = FindStored(digest);
    if (!stored.ok()) {
      jobs_.Forget(digest, watcher);
      return stored.status();
    }
    first = jobs_.CompleteWatch(digest, std::move(first), *stored);
  }
  first.Tell();
  return absl::OkStatus();
}

void QueueCore::Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  jobs_.Forget(digest, watcher);
}

absl::StatusOr<v1::Job> QueueCore::FindStored(const std::string& digest) {
  ASSIGN_OR_RETURN(const std::optional<JobRecord> record, database_.jobs().Find(digest));
  if (!record.has_value()) return NotFound(digest);
  return ToJob(*record);
}

}  // namespace carillon
