// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/queue_core.h"

#include <algorithm>
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
#include "server/decomposition/queue_refusals.h"
#include "server/decomposition/stored_model.h"

namespace carillon {
namespace {

// A daemon that was killed this often while a job ran may have been killed because of the job.
constexpr uint32_t kMostStarts = 10;

/// The filter for the stored states: running jobs are stored as queued ones.
JobFilter AsStored(JobFilter filter) {
  std::ranges::replace(filter.states, v1::JOB_STATE_RUNNING, v1::JOB_STATE_QUEUED);
  return filter;
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
    runs_.events().LogFailure(record, "");
    return database_.jobs().Put(record);
  }
  auto request = ParseRequest(record);
  JobWishes wishes = StoredWishes(record.digest);
  const WantedJob wanted{.digest = record.digest,
                         .request = request.value_or(v1::CreateModalModelRequest()),
                         .transfer_of = record.transfer_of,
                         .client = wishes.OtherThan("")};
  const absl::StatusOr<bool> satisfied =
      request.ok() ? IsSatisfied(database_, wanted, std::nullopt) : request.status();
  if (satisfied.ok() && !*satisfied && record.start_count < kMostStarts) {
    std::string coarse = StartCoarse(wanted, notices);
    runs_.Enqueue(
        std::move(record), *std::move(request),
        {.client = wanted.client, .wishes = std::move(wishes), .waits_for = std::move(coarse)});
    return absl::OkStatus();
  }
  const uint32_t start_count = std::exchange(record.start_count, 0);
  // A satisfied job has its result: the daemon was killed before it stored the job's end.
  if (satisfied.ok() && *satisfied) FollowByTransfer(wanted, notices);
  record.state = satisfied.ok() && *satisfied ? v1::JOB_STATE_SUCCEEDED : v1::JOB_STATE_FAILED;
  if (record.state == v1::JOB_STATE_FAILED) {
    record.error = satisfied.ok() ? GaveUp(start_count) : ToErrorInfo(satisfied.status());
    runs_.events().LogFailure(record, "");
  }
  return database_.jobs().Put(record);
}

/// Wishes that cannot be read leave a job that only callers with the role administer may cancel.
JobWishes QueueCore::StoredWishes(const std::string& digest) {
  return JobWishes(database_.jobs().Clients(digest).value_or(std::vector<std::string>()));
}

absl::Status QueueCore::AddWish(const std::string& digest, const std::string& client) {
  const std::optional<ActiveJob> active = jobs_.Find(digest);
  if (!active.has_value() || client.empty() || active->wishes.IsWantedBy(client)) {
    return absl::OkStatus();
  }
  RETURN_IF_ERROR(database_.jobs().AddClient(digest, client));
  jobs_.AddWish(digest, client);
  return absl::OkStatus();
}

void QueueCore::Stop() {
  database_.models().ListenToQuarantine(nullptr);
  runs_.Stop();
}

absl::StatusOr<v1::Job> QueueCore::Submit(const v1::CreateModalModelRequest& request,
                                          const std::string& client,
                                          const DecompositionQueue::MaterialCheck& check,
                                          bool may_change_pinned) {
  ASSIGN_OR_RETURN(const v1::CreateModalModelRequest resolved, ResolveRequest(request));
  WantedJob wanted = WantedModel(resolved);
  wanted.client = client;
  wanted.may_change_pinned = may_change_pinned;
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&runs_.writer());
    job = SubmitAny(wanted, notices);
    if (job.ok() && job->state() == v1::JOB_STATE_SUCCEEDED) FollowByTransfer(wanted, notices);
  }
  TellAll(notices);
  RETURN_IF_ERROR(job.status());
  // Objects without a material of their own get the one that was asked for, with its name.
  v1::Material material = request.material();
  const double poisson_ratio = resolved.settings().poisson_ratio();
  if (resolved.material().has_poisson_ratio() &&
      resolved.material().poisson_ratio() != poisson_ratio) {
    material.set_poisson_ratio(poisson_ratio);
  }
  if (check && !check(wanted.digest, material)) return job;
  RETURN_IF_ERROR(database_.models().RememberMaterial(wanted.digest, material));
  return job;
}

absl::StatusOr<v1::Job> QueueCore::SubmitTransfer(const std::string& model,
                                                  const v1::CreateTransferRequest& request,
                                                  const std::string& client,
                                                  bool may_change_pinned) {
  ASSIGN_OR_RETURN(WantedJob wanted, WantedTransfer(model, request));
  wanted.client = client;
  wanted.may_change_pinned = may_change_pinned;
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&runs_.writer());
    job = SubmitAny(wanted, notices);
  }
  TellAll(notices);
  return job;
}

absl::StatusOr<v1::Job> QueueCore::SubmitAny(const WantedJob& wanted, Notices& notices) {
  const std::optional<ActiveJob> active = jobs_.Find(wanted.digest);
  return active.has_value() ? SubmitAgain(*active, wanted) : SubmitNew(wanted, notices);
}

// The model of a request is stored: its transfer is asked for, too. Without room in the queue the
// next request for the model asks again.
void QueueCore::FollowByTransfer(const WantedJob& model, Notices& notices) {
  const bool wanted = settings_.transfers && !model.request.without_transfer();
  if (!wanted || !model.transfer_of.empty()) return;
  WantedJob transfer = WantedTransfer(model.digest, model.request);
  transfer.client = model.client;
  transfer.may_change_pinned = model.may_change_pinned;
  SubmitAny(transfer, notices).status().IgnoreError();
}

absl::StatusOr<v1::Job> QueueCore::SubmitNew(const WantedJob& wanted, Notices& notices) {
  const auto& [digest, request, transfer_of, client, may_change_pinned] = wanted;
  ASSIGN_OR_RETURN(const std::optional<JobRecord> known, database_.jobs().Find(digest));
  ASSIGN_OR_RETURN(const bool satisfied, IsSatisfied(database_, wanted, known));
  if (known.has_value() &&
      (satisfied ? known->state == v1::JOB_STATE_SUCCEEDED : WouldFailAgain(*known, request))) {
    // The record stays unchanged: its request tells how far the model was computed.
    return ToJob(*known);
  }
  if (!satisfied) {
    RETURN_IF_ERROR(CheckPin(database_.models(), wanted));
    RETURN_IF_ERROR(CheckAcceptable(wanted));
  }
  // The coarse job is stored first. A daemon that takes up this job then finds the coarse one.
  std::string coarse = satisfied ? "" : StartCoarse(wanted, notices);
  JobRecord record = NewRecord(wanted, clock_.UnixMs());
  if (satisfied) record.state = v1::JOB_STATE_SUCCEEDED;
  if (known.has_value()) record.peak_bytes = known->peak_bytes;
  RETURN_IF_ERROR(database_.jobs().Put(record, {client}));
  if (satisfied) {
    const v1::Job ended = ToJob(record);
    jobs_.TellEnded(ended);
    return ended;
  }
  runs_.Enqueue(std::move(record), request,
                {.client = client, .wishes = StoredWishes(digest), .waits_for = std::move(coarse)});
  runs_.StartWhatFits(notices);
  return Get(digest);
}

absl::Status QueueCore::CheckAcceptable(const WantedJob& wanted) {
  if (wanted.transfer_of.empty()) {
    RETURN_IF_ERROR(database_.meshes().Find(wanted.request.mesh_digest()).status());
  }
  const size_t count = jobs_.queued_count();
  if (count >= settings_.max_queued_count) return QueueFull(count, runs_.retry_after_s());
  const size_t own_count = jobs_.queued_count(wanted.client);
  if (own_count < settings_.max_queued_count_of_client) return absl::OkStatus();
  return ClientQueueFull(own_count, settings_.max_queued_count);
}

// The digest of the coarse model's job that the request has to wait for; empty if there is none. A
// request whose coarse model cannot be computed gets the fine one only.
std::string QueueCore::StartCoarse(const WantedJob& fine, Notices& notices) {
  const v1::CreateModalModelRequest& request = fine.request;
  const std::string& digest = fine.digest;
  if (!request.coarse_first() || database_.models().Summary(digest).ok()) return "";
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  const auto coarse = CoarseRequest(request, mesh.ok() ? mesh->byte_count : 0);
  if (!coarse.has_value()) return "";
  std::string coarse_digest = RequestDigest(*coarse);
  if (jobs_.Contains(coarse_digest)) {
    AddWish(coarse_digest, fine.client).IgnoreError();
  } else {
    WantedJob wanted = WantedModel(*coarse);
    wanted.client = fine.client;
    SubmitNew(wanted, notices).status().IgnoreError();
  }
  if (jobs_.Contains(coarse_digest)) return coarse_digest;
  database_.models().CopyIfAbsent(coarse_digest, digest, request.label()).IgnoreError();
  return "";
}

// A job that waits or runs serves all requests for its digest: it is extended up to the highest
// eigenvalue that any of them wants.
absl::StatusOr<v1::Job> QueueCore::SubmitAgain(const ActiveJob& active, const WantedJob& wanted) {
  const std::string& digest = wanted.digest;
  const v1::CreateModalModelRequest& request = wanted.request;
  const bool wanted_no_more = active.record.state == v1::JOB_STATE_CANCELLED || active.deleted;
  const bool farther = WantsMore(request, active.request);
  const bool sooner = request.priority() > active.record.priority;
  if (wanted_no_more || farther) RETURN_IF_ERROR(CheckPin(database_.models(), wanted));
  RETURN_IF_ERROR(AddWish(active.waits_for, wanted.client));
  if (!wanted_no_more) RETURN_IF_ERROR(AddWish(digest, wanted.client));
  if (!wanted_no_more && !farther && !sooner) return Get(digest);
  JobRecord record = active.record;
  record.state = v1::JOB_STATE_QUEUED;
  record.priority = std::max(record.priority, request.priority());
  if (wanted_no_more || farther) record.request = request.SerializeAsString();
  RETURN_IF_ERROR(database_.jobs().Put(record, {wanted.client}));
  return jobs_
      .Change(digest,
              [&](ActiveJob& job) {
                job.record = std::move(record);
                if (wanted_no_more || farther) job.request = request;
                job.again = job.again || wanted_no_more;
                job.wishes.Add(wanted.client);
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
  runs_.Enqueue(**std::move(record), *std::move(request));
  runs_.StartWhatFits(notices);
  return true;
}

DecompositionQueue::Counts QueueCore::counts() {
  const ActiveJobs::Counts now = jobs_.CountStates();
  DecompositionQueue::Counts counts = runs_.ended();
  counts.queued = now.queued;
  counts.running = now.running;
  return counts;
}

absl::StatusOr<v1::Job> QueueCore::Get(const std::string& digest) {
  // The memory is read first, because a job leaves it only after its end is stored.
  if (auto active = jobs_.View(digest)) return *std::move(active);
  return FindStored(digest);
}

absl::StatusOr<DecompositionJobPage> QueueCore::List(int page_size, const std::string& page_token,
                                                     const JobFilter& filter) {
  // The memory is read first: a job that a client has seen running is not listed as queued then.
  std::map<std::string, v1::Job> active = jobs_.ViewAll();
  ASSIGN_OR_RETURN(JobPage records, database_.jobs().List(page_size, page_token, AsStored(filter)));
  DecompositionJobPage page;
  // The database stores running jobs as queued, so the filter is applied again to the present
  // states. A page without a matching job is skipped.
  while (true) {
    for (const JobRecord& record : records.jobs) {
      const auto job = active.find(record.digest);
      v1::Job view = job == active.end() ? ToJob(record) : job->second;
      if (Matches(view, filter)) page.jobs.push_back(std::move(view));
    }
    page.next_page_token = records.next_page_token;
    if (!page.jobs.empty() || page.next_page_token.empty()) return page;
    ASSIGN_OR_RETURN(records,
                     database_.jobs().List(page_size, page.next_page_token, AsStored(filter)));
  }
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
  if (!record.has_value()) return JobNotFound(digest);
  return ToJob(*record);
}

}  // namespace carillon
