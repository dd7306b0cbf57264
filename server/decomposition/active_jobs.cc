// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/active_jobs.h"

#include <algorithm>
#include <utility>

#include "server/decomposition/job/job_rules.h"

namespace carillon {
namespace {

// A job as clients see it. `wait` is what it waits for if it is in the queue.
v1::Job Shown(const ActiveJob& job, const v1::JobWait& wait) {
  const bool runs = job.runs();
  v1::Job view = ToJob(job.record);
  view.set_state(runs ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_QUEUED);
  view.set_memory_bytes(std::max(job.record.peak_bytes, job.estimate_bytes));
  view.set_coarse_ready(job.coarse_ready);
  if (runs) {
    *view.mutable_progress() = job.progress;
    view.set_started_unix_ms(job.started_unix_ms);
  } else if (job.stage == JobStage::kAwaitsCoarse) {
    view.mutable_wait()->set_cause(v1::WAIT_CAUSE_COARSE_MODEL);
  } else if (wait.cause() != v1::WAIT_CAUSE_UNSPECIFIED) {
    *view.mutable_wait() = wait;
  }
  return view;
}

}  // namespace

ActiveJobs::ActiveJobs(const JobCapacity& capacity, const MemoryExperience& experience)
    : experience_(experience) {
  places_.SetCapacity(capacity);
}

std::optional<ActiveJob> ActiveJobs::Find(const std::string& digest) {
  MutexLock lock(&mutex_);
  const auto job = jobs_.find(digest);
  if (job == jobs_.end()) return std::nullopt;
  return job->second;
}

bool ActiveJobs::Contains(const std::string& digest) {
  MutexLock lock(&mutex_);
  return jobs_.contains(digest);
}

std::vector<ActiveJob> ActiveJobs::Select(absl::FunctionRef<bool(const ActiveJob&)> wanted) {
  MutexLock lock(&mutex_);
  std::vector<ActiveJob> selected;
  for (const auto& [digest, job] : jobs_) {
    if (wanted(job)) selected.push_back(job);
  }
  return selected;
}

ActiveJobs::Counts ActiveJobs::Count(const std::string& client) {
  MutexLock lock(&mutex_);
  const auto running = static_cast<size_t>(
      std::ranges::count_if(jobs_, [](const auto& job) { return job.second.runs(); }));
  return {.queued = jobs_.size() - running,
          .running = running,
          .in_queue = decompositions_.size() + transfers_.size(),
          .in_queue_of_client = decompositions_.size(client) + transfers_.size(client)};
}

std::optional<v1::Job> ActiveJobs::View(const std::string& digest) {
  MutexLock lock(&mutex_);
  const auto job = jobs_.find(digest);
  if (job == jobs_.end()) return std::nullopt;
  return ViewOf(job->second);
}

std::map<std::string, v1::Job> ActiveJobs::ViewAll() {
  MutexLock lock(&mutex_);
  std::map<std::string, v1::Job> views;
  ForEachView(
      [&](const ActiveJob& job, const v1::Job& view) { views.emplace(job.record.digest, view); });
  return views;
}

void ActiveJobs::Add(ActiveJob job) {
  MutexLock lock(&mutex_);
  job.estimate_bytes =
      job.record.transfer_of.empty() ? experience_.Corrected(job.guess_bytes) : job.guess_bytes;
  if (job.record.peak_bytes > 0) job.estimate_bytes = job.record.peak_bytes;
  const std::string digest = job.record.digest;
  job.stage = job.waits_for.empty() ? JobStage::kWaits : JobStage::kAwaitsCoarse;
  job.number = ++last_number_;
  const ActiveJob& added = jobs_.emplace(digest, std::move(job)).first->second;
  if (added.stage == JobStage::kWaits) QueueOf(added).Add(EntryOf(added));
  if (watchers_.has_sinks()) watchers_.TellSinks(ViewOf(added));
}

Notice ActiveJobs::Apply(const std::string& digest, const JobEvent& event) {
  MutexLock lock(&mutex_);
  const auto found = jobs_.find(digest);
  ActiveJob& job = found->second;
  QueueOf(job).Remove(EntryOf(job));
  JobStep step = Transition(std::move(job), event);
  job = std::move(step.job);
  if (step.action == JobAction::kEnd) {
    const v1::Job last = ToJob(job.record);
    jobs_.erase(found);
    return watchers_.AnnounceEnd(digest, last);
  }
  if (step.action == JobAction::kWaitAgain) job.number = ++last_number_;
  if (job.stage == JobStage::kWaits) QueueOf(job).Add(EntryOf(job));
  return watchers_.Announce(digest, ViewOf(job));
}

std::optional<ActiveJob> ActiveJobs::BeginRun(const Clock& clock) {
  MutexLock lock(&mutex_);
  for (FairQueue* queue : {&decompositions_, &transfers_}) {
    const std::optional<std::string> next = queue->Next();
    if (!next.has_value()) continue;
    ActiveJob& job = jobs_.at(*next);
    if (WaitCauseOf(KindOf(job.record)) != v1::WAIT_CAUSE_UNSPECIFIED) continue;
    queue->Remove(EntryOf(job));
    queue->NoteStart(job.client);
    places_.Take(*next, KindOf(job.record), job.estimate_bytes);
    job.stage = JobStage::kRuns;
    job.given = job.request;
    job.started = clock.Monotonic();
    job.started_unix_ms = clock.UnixMs();
    job.progress.Clear();
    ++job.record.start_count;
    return job;
  }
  return std::nullopt;
}

Notice ActiveJobs::AnnounceRun(const std::string& digest) {
  MutexLock lock(&mutex_);
  return watchers_.Announce(digest, ViewOf(jobs_.at(digest)));
}

std::vector<std::string> ActiveJobs::BeginYielding() {
  MutexLock lock(&mutex_);
  if (WaitCauseOf(v1::JOB_KIND_DECOMPOSITION) != v1::WAIT_CAUSE_MEMORY) return {};
  const uint64_t bytes = jobs_.at(*decompositions_.Next()).estimate_bytes;
  std::vector<std::string> digests = places_.ChooseToEnd(bytes);
  for (const std::string& digest : digests) {
    // A run that is to end anyway goes on to its own end.
    JobStage& stage = jobs_.at(digest).stage;
    if (stage == JobStage::kRuns) stage = JobStage::kYields;
  }
  return digests;
}

Notice ActiveJobs::Report(const std::string& digest, const v1::Progress& progress) {
  MutexLock lock(&mutex_);
  ActiveJob& job = jobs_.at(digest);
  if (job.progress.node_count() == 0 && progress.node_count() > 0) {
    job.guess_bytes = MemoryOfNodes(progress.node_count());
    job.estimate_bytes = experience_.Corrected(job.guess_bytes);
    places_.Resize(digest, job.estimate_bytes);
  }
  job.progress = progress;
  return watchers_.Announce(digest, ViewOf(job));
}

ActiveJob ActiveJobs::EndRun(const std::string& digest, uint64_t peak_bytes) {
  MutexLock lock(&mutex_);
  places_.Free(digest);
  const ActiveJob& job = jobs_.at(digest);
  if (job.record.transfer_of.empty() && peak_bytes > 0) {
    experience_.Learn(job.guess_bytes, peak_bytes);
  }
  return job;
}

std::vector<Notice> ActiveJobs::NewsOfWaiting() {
  MutexLock lock(&mutex_);
  std::vector<Notice> news;
  if (!watchers_.has_watchers()) return news;
  ForEachWaiting([&](const ActiveJob& job, const v1::JobWait& wait) ABSL_NO_THREAD_SAFETY_ANALYSIS {
    if (!watchers_.HasWatchers(job.record.digest)) return;
    news.push_back(watchers_.For(job.record.digest, Shown(job, wait)));
  });
  return news;
}

MemoryExperience ActiveJobs::experience() {
  MutexLock lock(&mutex_);
  return experience_;
}

Notice ActiveJobs::Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  MutexLock lock(&mutex_);
  watchers_.Add(digest, watcher);
  const auto job = jobs_.find(digest);
  return watchers_.For(watcher, job == jobs_.end() ? v1::Job() : ViewOf(job->second));
}

Notice ActiveJobs::CompleteWatch(const std::string& digest, Notice watch, const v1::Job& stored) {
  MutexLock lock(&mutex_);
  if (const auto job = jobs_.find(digest); job != jobs_.end()) {
    return watchers_.For(watch.watchers.front(), ViewOf(job->second));
  }
  // The notice keeps the version of the registration: any change announced since is newer.
  watch.job = stored;
  if (HasEnded(stored.state())) watchers_.Erase(digest, watch.watchers.front());
  return watch;
}

void ActiveJobs::Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  MutexLock lock(&mutex_);
  watchers_.Erase(digest, watcher);
}

void ActiveJobs::WatchAll(JobSink& sink) {
  MutexLock lock(&mutex_);
  ForEachView([&sink](const ActiveJob&, const v1::Job& view) { sink.Take(view); });
  sink.TakeBegin();
  watchers_.Add(sink);
}

void ActiveJobs::Forget(JobSink& sink) {
  MutexLock lock(&mutex_);
  watchers_.Erase(sink);
}

void ActiveJobs::TellEnded(const v1::Job& job) {
  MutexLock lock(&mutex_);
  watchers_.TellSinks(job);
}

FairQueue::Entry ActiveJobs::EntryOf(const ActiveJob& job) {
  return {.client = job.client,
          .priority = job.record.priority,
          .number = job.number,
          .digest = job.record.digest};
}

FairQueue& ActiveJobs::QueueOf(v1::JobKind kind) {
  return kind == v1::JOB_KIND_DECOMPOSITION ? decompositions_ : transfers_;
}

FairQueue& ActiveJobs::QueueOf(const ActiveJob& job) { return QueueOf(KindOf(job.record)); }

// Why the first waiting job of a kind cannot start.
v1::WaitCause ActiveJobs::WaitCauseOf(v1::JobKind kind) {
  const bool radiates = kind == v1::JOB_KIND_TRANSFER;
  // The memory that becomes free is the decomposition's that waits for it.
  if (radiates && WaitCauseOf(v1::JOB_KIND_DECOMPOSITION) == v1::WAIT_CAUSE_MEMORY) {
    return v1::WAIT_CAUSE_MEMORY;
  }
  const std::optional<std::string> next = (radiates ? transfers_ : decompositions_).Next();
  if (!next.has_value()) return v1::WAIT_CAUSE_UNSPECIFIED;
  return places_.Obstacle(kind, jobs_.at(*next).estimate_bytes);
}

// What the waiting jobs of a kind wait for. Their places in the queue are added for each job.
v1::JobWait ActiveJobs::WaitOf(v1::JobKind kind) {
  v1::JobWait wait;
  wait.set_cause(WaitCauseOf(kind));
  if (wait.cause() == v1::WAIT_CAUSE_UNSPECIFIED) return wait;  // the first of them starts now
  const std::vector<std::string> occupants = places_.Occupants(kind, wait.cause());
  wait.set_running_job_count(static_cast<uint32_t>(occupants.size()));
  if (occupants.size() == 1) wait.set_running_job_label(jobs_.at(occupants[0]).record.label);
  return wait;
}

v1::Job ActiveJobs::ViewOf(const ActiveJob& job) {
  if (job.stage != JobStage::kWaits) return Shown(job, {});
  v1::JobWait wait = WaitOf(KindOf(job.record));
  const std::vector<absl::string_view> order = QueueOf(job).Order();
  const auto place = std::ranges::find(order, job.record.digest) - order.begin();
  wait.set_earlier_job_count(static_cast<uint32_t>(place));
  return Shown(job, wait);
}

void ActiveJobs::ForEachWaiting(
    absl::FunctionRef<void(const ActiveJob&, const v1::JobWait&)> visit) {
  for (const v1::JobKind kind : {v1::JOB_KIND_DECOMPOSITION, v1::JOB_KIND_TRANSFER}) {
    v1::JobWait wait = WaitOf(kind);
    uint32_t earlier_count = 0;
    for (const absl::string_view digest : QueueOf(kind).Order()) {
      wait.set_earlier_job_count(earlier_count++);
      visit(jobs_.at(std::string(digest)), wait);
    }
  }
}

// In time linear in the number of jobs, for whoever wants to see all of them.
void ActiveJobs::ForEachView(absl::FunctionRef<void(const ActiveJob&, const v1::Job&)> visit) {
  for (const auto& [digest, job] : jobs_) {
    if (job.stage != JobStage::kWaits) visit(job, Shown(job, {}));
  }
  ForEachWaiting(
      [&](const ActiveJob& job, const v1::JobWait& wait) { visit(job, Shown(job, wait)); });
}

}  // namespace carillon
