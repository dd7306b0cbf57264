// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/decomposition_queue.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/decomposition/job/coarse_request.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/job/job_rules.h"
#include "server/decomposition/job/stored_model.h"

namespace carillon {
namespace {

// A daemon that was killed this often while a job ran may have been killed because of the job.
constexpr uint32_t kMostStarts = 10;

absl::Status JobNotFound(const std::string& digest) {
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

absl::Status ClientQueueFull(size_t count, size_t whole) {
  return Refusal(absl::StatusCode::kResourceExhausted, "CLIENT_LIMIT_REACHED",
                 absl::StrCat(count, " decompositions of this client wait already, its share of ",
                              whole, ": wait until some have run"));
}

/// The filter for the stored states: running jobs are stored as queued ones.
JobFilter AsStored(JobFilter filter) {
  std::ranges::replace(filter.states, v1::JOB_STATE_RUNNING, v1::JOB_STATE_QUEUED);
  return filter;
}

JobCapacity CapacityOf(const Executor& executor) {
  return {.worker_count = executor.worker_count(),
          .memory_budget_bytes = executor.memory_budget_bytes(),
          .transfers_yield = executor.transfers_yield()};
}

}  // namespace

DecompositionQueue::DecompositionQueue(ModeDatabase& database, std::unique_ptr<Executor> executor,
                                       const Clock& clock, QueueSettings settings)
    : database_(database),
      clock_(clock),
      settings_(std::move(settings)),
      events_(clock, settings_.log_event),
      journal_(database, events_),
      jobs_(std::make_shared<ActiveJobs>(CapacityOf(*executor), journal_.ReadExperience())),
      runs_(database, std::move(executor), clock, *jobs_, journal_, events_, settings_) {}

DecompositionQueue::~DecompositionQueue() {
  database_.models().ListenToQuarantine(nullptr);
  runs_.Stop();
}

absl::StatusOr<std::unique_ptr<DecompositionQueue>> DecompositionQueue::Make(
    ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
    QueueSettings settings) {
  std::unique_ptr<DecompositionQueue> queue(
      new DecompositionQueue(database, std::move(executor), clock, std::move(settings)));
  RETURN_IF_ERROR(queue->TakeUp());
  return queue;
}

absl::Status DecompositionQueue::TakeUp() {
  ASSIGN_OR_RETURN(const auto records, database_.jobs().Unfinished());
  Notices notices;  // nobody watches yet
  database_.models().ListenToQuarantine(
      [this](const std::string& digest, const absl::Status& why) { OnQuarantine(digest, why); });
  MutexLock lock(&runs_.writer());
  for (const JobRecord& record : records) {
    // A coarse model's job may have been queued already, by the job that waits for it.
    if (jobs_->Contains(record.digest)) continue;
    RETURN_IF_ERROR(TakeUpJob(record, notices));
  }
  runs_.StartWhatFits(notices);
  return absl::OkStatus();
}

absl::Status DecompositionQueue::TakeUpJob(JobRecord record, Notices& notices) {
  if (record.damaged) {
    events_.LogFailure(record, "");
    return journal_.Put(record);
  }
  auto request = ParseRequest(record);
  JobWishes wishes = journal_.ReadWishes(record.digest);
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
    events_.LogFailure(record, "");
  }
  return journal_.Put(record);
}

absl::Status DecompositionQueue::AddWish(const std::string& digest, const std::string& client) {
  const std::optional<ActiveJob> active = jobs_->Find(digest);
  if (!active.has_value() || client.empty() || active->wishes.IsWantedBy(client)) {
    return absl::OkStatus();
  }
  RETURN_IF_ERROR(journal_.AddClient(digest, client));
  jobs_->Apply(digest, Wished{client});
  return absl::OkStatus();
}

absl::StatusOr<v1::Job> DecompositionQueue::Submit(const v1::CreateModalModelRequest& request,
                                                   const std::string& client,
                                                   const MaterialCheck& check,
                                                   bool may_change_pinned) {
  ASSIGN_OR_RETURN(const v1::CreateModalModelRequest resolved, ResolveRequest(request));
  WantedJob wanted = WantedModel(resolved);
  wanted.client = client;
  wanted.may_change_pinned = may_change_pinned;
  ASSIGN_OR_RETURN(v1::Job job, SubmitAndTell(wanted));
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

absl::StatusOr<v1::Job> DecompositionQueue::SubmitTransfer(const std::string& model,
                                                           const v1::CreateTransferRequest& request,
                                                           const std::string& client,
                                                           bool may_change_pinned) {
  ASSIGN_OR_RETURN(WantedJob wanted, WantedTransfer(model, request));
  wanted.client = client;
  wanted.may_change_pinned = may_change_pinned;
  return SubmitAndTell(wanted);
}

absl::StatusOr<v1::Job> DecompositionQueue::SubmitAndTell(const WantedJob& wanted) {
  CopyStoredCoarseModel(wanted);
  Notices notices;
  absl::StatusOr<v1::Job> job;
  {
    MutexLock lock(&runs_.writer());
    job = SubmitAny(wanted, notices);
    if (job.ok() && job->state() == v1::JOB_STATE_SUCCEEDED) FollowByTransfer(wanted, notices);
  }
  TellAll(notices);
  return job;
}

absl::StatusOr<v1::Job> DecompositionQueue::SubmitAny(const WantedJob& wanted, Notices& notices) {
  const std::optional<ActiveJob> active = jobs_->Find(wanted.digest);
  return active.has_value() ? SubmitAgain(*active, wanted) : SubmitNew(wanted, notices);
}

// The model of a request is stored: its transfer is asked for, too. Without room in the queue the
// next request for the model asks again.
void DecompositionQueue::FollowByTransfer(const WantedJob& model, Notices& notices) {
  const bool wanted = settings_.transfers && !model.request.without_transfer();
  if (!wanted || !model.transfer_of.empty()) return;
  WantedJob transfer = WantedTransfer(model.digest, model.request);
  transfer.client = model.client;
  transfer.may_change_pinned = model.may_change_pinned;
  SubmitAny(transfer, notices).status().IgnoreError();
}

absl::StatusOr<v1::Job> DecompositionQueue::SubmitNew(const WantedJob& wanted, Notices& notices) {
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
  RETURN_IF_ERROR(journal_.Put(record, {client}));
  if (satisfied) {
    const v1::Job ended = ToJob(record);
    jobs_->TellEnded(ended);
    return ended;
  }
  runs_.Enqueue(
      std::move(record), request,
      {.client = client, .wishes = journal_.ReadWishes(digest), .waits_for = std::move(coarse)});
  runs_.StartWhatFits(notices);
  return Get(digest);
}

absl::Status DecompositionQueue::CheckAcceptable(const WantedJob& wanted) {
  if (wanted.transfer_of.empty()) {
    RETURN_IF_ERROR(database_.meshes().Find(wanted.request.mesh_digest()).status());
  }
  const ActiveJobs::Counts now = jobs_->Count(wanted.client);
  if (now.in_queue >= settings_.max_queued_count) {
    return QueueFull(now.in_queue, runs_.retry_after_s());
  }
  if (now.in_queue_of_client < settings_.max_queued_count_of_client) return absl::OkStatus();
  return ClientQueueFull(now.in_queue_of_client, settings_.max_queued_count);
}

// The request for the coarse model that is wanted before the model of a request, as long as there
// is none.
std::optional<v1::CreateModalModelRequest> DecompositionQueue::CoarseOf(const WantedJob& fine) {
  const v1::CreateModalModelRequest& request = fine.request;
  if (!request.coarse_first() || database_.models().Summary(fine.digest).ok()) return std::nullopt;
  const auto mesh = database_.meshes().Find(request.mesh_digest());
  return CoarseRequest(request, mesh.ok() ? mesh->byte_count : 0);
}

// Gives a job that is about to be submitted the coarse model that is stored already. A copy may
// take a while, so it is made before the lock is taken in which the job is submitted.
void DecompositionQueue::CopyStoredCoarseModel(const WantedJob& fine) {
  const auto coarse = CoarseOf(fine);
  if (!coarse.has_value()) return;
  const std::string digest = RequestDigest(*coarse);
  {
    const MutexLock lock(&runs_.writer());
    if (jobs_->Contains(fine.digest) || jobs_->Contains(digest)) return;
    const auto known = database_.jobs().Find(digest);
    const auto stored = IsSatisfied(database_.models(), digest,
                                    known.value_or(std::optional<JobRecord>()), *coarse);
    if (!stored.value_or(false) || !CheckAcceptable(fine).ok()) return;
  }
  journal_.NoteCoarseModel(digest, fine.digest, fine.request.label());
}

// The digest of the coarse model's job that the request has to wait for; empty if there is none. A
// request whose coarse model cannot be computed gets the fine one only.
std::string DecompositionQueue::StartCoarse(const WantedJob& fine, Notices& notices) {
  const auto coarse = CoarseOf(fine);
  if (!coarse.has_value()) return "";
  WantedJob wanted = WantedModel(*coarse);
  wanted.client = fine.client;
  if (jobs_->Contains(wanted.digest)) {
    events_.LogUnstored("client", wanted.digest, AddWish(wanted.digest, fine.client));
  } else {
    SubmitNew(wanted, notices).status().IgnoreError();
  }
  return jobs_->Contains(wanted.digest) ? wanted.digest : "";
}

// A job that waits or runs serves all requests for its digest: it is extended up to the highest
// eigenvalue that any of them wants.
absl::StatusOr<v1::Job> DecompositionQueue::SubmitAgain(const ActiveJob& active,
                                                        const WantedJob& wanted) {
  const std::string& digest = wanted.digest;
  const v1::CreateModalModelRequest& request = wanted.request;
  const bool anew = IsWantedNoMore(active);
  const bool farther = WantsMore(request, active.request);
  if (anew || farther) RETURN_IF_ERROR(CheckPin(database_.models(), wanted));
  RETURN_IF_ERROR(AddWish(active.waits_for, wanted.client));
  if (!anew) RETURN_IF_ERROR(AddWish(digest, wanted.client));
  if (!anew && !farther && request.priority() <= active.record.priority) return Get(digest);
  const Submitted submitted{request, wanted.client};
  RETURN_IF_ERROR(journal_.Put(Transition(active, submitted).job.record, {wanted.client}));
  return jobs_->Apply(digest, submitted).job;
}

absl::StatusOr<v1::Job> DecompositionQueue::Cancel(const std::string& digest,
                                                   const std::optional<std::string>& client) {
  Notices notices;
  v1::Job job;
  {
    MutexLock lock(&runs_.writer());
    const std::optional<ActiveJob> active = jobs_->Find(digest);
    if (!active.has_value()) return FindStored(digest);
    if (client.has_value()) {
      RETURN_IF_ERROR(active->wishes.CheckCancel(digest, *client));
      if (!active->wishes.OtherThan(*client).empty()) {
        // The job goes on for the others, and then counts for one of them.
        RETURN_IF_ERROR(journal_.RemoveClient(digest, *client));
        return jobs_->Apply(digest, Withdrawn{*client}).job;
      }
    }
    const JobStep step = Transition(*active, Cancelled{});
    // The worker ends first, because the database may take a while.
    if (step.action == JobAction::kStopRun) runs_.StopRun(digest);
    RETURN_IF_ERROR(journal_.Put(step.job.record));
    notices.push_back(jobs_->Apply(digest, Cancelled{}));
    job = notices.back().job;
    if (step.action == JobAction::kEnd) runs_.GoOnAfter(digest, notices);
  }
  TellAll(notices);
  return job;
}

absl::Status DecompositionQueue::DeleteModel(const std::string& digest) {
  Notices notices;
  {
    MutexLock lock(&runs_.writer());
    RETURN_IF_ERROR(database_.models().Delete(digest));
    for (const ActiveJob& transfer :
         jobs_->Select([&](const ActiveJob& job) { return job.record.transfer_of == digest; })) {
      Drop(transfer.record.digest, notices);
    }
    Drop(digest, notices);
  }
  TellAll(notices);
  return absl::OkStatus();
}

// Ends a job that waits or runs and whose row is no longer in the database.
void DecompositionQueue::Drop(const std::string& digest, Notices& notices) {
  const std::optional<ActiveJob> active = jobs_->Find(digest);
  if (!active.has_value()) return;
  if (active->runs()) runs_.StopRun(digest);
  notices.push_back(jobs_->Apply(digest, ModelDeleted{}));
  if (!active->runs()) runs_.GoOnAfter(digest, notices);
}

void DecompositionQueue::OnQuarantine(const std::string& digest, const absl::Status& why) {
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
bool DecompositionQueue::ComputeAgain(const std::string& digest, Notices& notices) {
  if (jobs_->Contains(digest)) return true;
  auto record = database_.jobs().Find(digest);
  if (!record.ok() || !record->has_value() || (*record)->damaged) return false;
  auto request = ParseRequest(**record);
  if (!request.ok()) return false;
  (*record)->state = v1::JOB_STATE_QUEUED;
  if (!journal_.Put(**record).ok()) return false;
  runs_.Enqueue(**std::move(record), *std::move(request));
  runs_.StartWhatFits(notices);
  return true;
}

DecompositionQueue::Counts DecompositionQueue::counts() {
  const ActiveJobs::Counts now = jobs_->Count();
  Counts counts = runs_.ended();
  counts.queued = now.queued;
  counts.running = now.running;
  return counts;
}

absl::StatusOr<v1::Job> DecompositionQueue::Get(const std::string& digest) {
  // The memory is read first, because a job leaves it only after its end is stored.
  if (auto active = jobs_->View(digest)) return *std::move(active);
  return FindStored(digest);
}

absl::StatusOr<DecompositionJobPage> DecompositionQueue::List(int page_size,
                                                              const std::string& page_token,
                                                              const JobFilter& filter) {
  // The memory is read first: a job that a client has seen running is not listed as queued then.
  std::map<std::string, v1::Job> active = jobs_->ViewAll();
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

absl::StatusOr<std::unique_ptr<JobWatch>> DecompositionQueue::Watch(
    const std::string& digest, std::function<void(const v1::Job&)> on_change) {
  auto watcher = std::make_shared<Watcher>(std::move(on_change));
  // The watcher is registered before the database is read, so that it misses no change.
  Notice first = jobs_->Watch(digest, watcher);
  if (first.job.name().empty()) {
    const absl::StatusOr<v1::Job> stored = FindStored(digest);
    if (!stored.ok()) {
      jobs_->Forget(digest, watcher);
      return stored.status();
    }
    first = jobs_->CompleteWatch(digest, std::move(first), *stored);
  }
  first.Tell();
  return std::make_unique<JobWatch>([jobs = std::weak_ptr(jobs_), digest, watcher] {
    watcher->Close();
    if (const auto active = jobs.lock()) active->Forget(digest, watcher);
  });
}

std::unique_ptr<JobWatch> DecompositionQueue::WatchAll(JobSink& sink) {
  jobs_->WatchAll(sink);
  return std::make_unique<JobWatch>([jobs = std::weak_ptr(jobs_), &sink] {
    if (const auto active = jobs.lock()) active->Forget(sink);
  });
}

absl::StatusOr<v1::Job> DecompositionQueue::FindStored(const std::string& digest) {
  ASSIGN_OR_RETURN(const std::optional<JobRecord> record, database_.jobs().Find(digest));
  if (!record.has_value()) return JobNotFound(digest);
  return ToJob(*record);
}

}  // namespace carillon
