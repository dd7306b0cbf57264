// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/active_jobs.h"

#include <algorithm>
#include <utility>

#include "server/decomposition/job_rules.h"

namespace carillon {

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

size_t ActiveJobs::queued_count() {
  MutexLock lock(&mutex_);
  return queue_.size();
}

size_t ActiveJobs::queued_count(const std::string& client) {
  MutexLock lock(&mutex_);
  return queue_.size(client);
}

ActiveJobs::Counts ActiveJobs::CountStates() {
  MutexLock lock(&mutex_);
  const auto running = static_cast<size_t>(
      std::ranges::count_if(jobs_, [](const auto& job) { return job.second.running.has_value(); }));
  return {.queued = jobs_.size() - running, .running = running};
}

std::vector<ActiveJob> ActiveJobs::Running() {
  MutexLock lock(&mutex_);
  std::vector<ActiveJob> running;
  for (const auto& [digest, job] : jobs_) {
    if (job.running.has_value()) running.push_back(job);
  }
  return running;
}

std::vector<std::string> ActiveJobs::TransfersOf(const std::string& model) {
  MutexLock lock(&mutex_);
  std::vector<std::string> digests;
  for (const auto& [digest, job] : jobs_) {
    if (job.record.transfer_of == model) digests.push_back(digest);
  }
  return digests;
}

std::vector<std::string> ActiveJobs::WaitingFor(const std::string& coarse) {
  MutexLock lock(&mutex_);
  std::vector<std::string> digests;
  for (const auto& [digest, job] : jobs_) {
    if (job.waits_for == coarse) digests.push_back(digest);
  }
  return digests;
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
  for (const auto& [digest, job] : jobs_) views.emplace(digest, ViewOf(job));
  return views;
}

void ActiveJobs::Add(ActiveJob job) {
  MutexLock lock(&mutex_);
  job.estimate_bytes =
      job.record.transfer_of.empty() ? experience_.Corrected(job.guess_bytes) : job.guess_bytes;
  if (job.record.peak_bytes > 0) job.estimate_bytes = job.record.peak_bytes;
  const std::string digest = job.record.digest;
  ActiveJob& added = jobs_.emplace(digest, std::move(job)).first->second;
  Enqueue(added);
  TellSinks(ViewOf(added));
}

Notice ActiveJobs::Change(const std::string& digest, absl::FunctionRef<void(ActiveJob&)> change) {
  MutexLock lock(&mutex_);
  ActiveJob& job = jobs_.at(digest);
  queue_.Remove(EntryOf(job));
  change(job);
  if (!job.running.has_value() && job.waits_for.empty()) queue_.Add(EntryOf(job));
  return Announce(job);
}

Notice ActiveJobs::Remove(const std::string& digest, const v1::Job& last) {
  MutexLock lock(&mutex_);
  const auto job = jobs_.find(digest);
  queue_.Remove(EntryOf(job->second));
  jobs_.erase(job);
  TellSinks(last);
  Notice notice{{}, last, ++version_};
  if (auto watchers = watchers_.extract(digest)) notice.watchers = std::move(watchers.mapped());
  return notice;
}

std::optional<ActiveJob> ActiveJobs::BeginRun(const Capacity& capacity,
                                              std::chrono::nanoseconds now) {
  MutexLock lock(&mutex_);
  const std::optional<std::string> next = queue_.Next();
  if (!next.has_value() || running_count_ >= capacity.worker_count) return std::nullopt;
  ActiveJob& job = jobs_.at(*next);
  const bool fits = reserved_bytes_ + job.estimate_bytes <= capacity.memory_bytes;
  if (!fits && running_count_ > 0) return std::nullopt;
  queue_.Remove(EntryOf(job));
  queue_.NoteStart(job.client);
  ++running_count_;
  Reserve(job, job.estimate_bytes);
  job.running = job.request;
  job.started = now;
  job.progress.Clear();
  ++job.record.start_count;
  return job;
}

Notice ActiveJobs::Report(const std::string& digest, const v1::Progress& progress) {
  MutexLock lock(&mutex_);
  ActiveJob& job = jobs_.at(digest);
  if (job.progress.node_count() == 0 && progress.node_count() > 0) {
    job.guess_bytes = MemoryOfNodes(progress.node_count());
    job.estimate_bytes = experience_.Corrected(job.guess_bytes);
    Reserve(job, job.estimate_bytes);
  }
  job.progress = progress;
  return Announce(job);
}

ActiveJob ActiveJobs::EndRun(const std::string& digest) {
  MutexLock lock(&mutex_);
  ActiveJob& job = jobs_.at(digest);
  --running_count_;
  Reserve(job, 0);
  return job;
}

Notice ActiveJobs::QueueAgain(ActiveJob job) {
  MutexLock lock(&mutex_);
  job.running.reset();
  ActiveJob& queued = jobs_.at(job.record.digest);
  queued = std::move(job);
  Enqueue(queued);
  return Announce(queued);
}

Notice ActiveJobs::Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  MutexLock lock(&mutex_);
  watchers_[digest].push_back(watcher);
  const auto job = jobs_.find(digest);
  return {{watcher}, job == jobs_.end() ? v1::Job() : ViewOf(job->second), ++version_};
}

Notice ActiveJobs::CompleteWatch(const std::string& digest, Notice watch, const v1::Job& stored) {
  MutexLock lock(&mutex_);
  if (const auto job = jobs_.find(digest); job != jobs_.end()) {
    return {std::move(watch.watchers), ViewOf(job->second), ++version_};
  }
  // The notice keeps the version of the registration: any change announced since is newer.
  watch.job = stored;
  if (HasEnded(stored.state())) EraseWatcher(digest, watch.watchers.front());
  return watch;
}

void ActiveJobs::Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  MutexLock lock(&mutex_);
  EraseWatcher(digest, watcher);
}

void ActiveJobs::WatchAll(JobSink& sink) {
  MutexLock lock(&mutex_);
  for (const auto& [digest, job] : jobs_) sink.Take(ViewOf(job));
  sink.TakeBegin();
  sinks_.insert(&sink);
}

void ActiveJobs::Forget(JobSink& sink) {
  MutexLock lock(&mutex_);
  sinks_.erase(&sink);
}

void ActiveJobs::TellEnded(const v1::Job& job) {
  MutexLock lock(&mutex_);
  TellSinks(job);
}

void ActiveJobs::SetExperience(const MemoryExperience& experience) {
  MutexLock lock(&mutex_);
  experience_ = experience;
}

double ActiveJobs::Learn(uint64_t guess_bytes, uint64_t peak_bytes) {
  MutexLock lock(&mutex_);
  experience_.Learn(guess_bytes, peak_bytes);
  return experience_.correction();
}

FairQueue::Entry ActiveJobs::EntryOf(const ActiveJob& job) {
  return {.client = job.client,
          .priority = job.record.priority,
          .number = job.number,
          .digest = job.record.digest};
}

v1::Job ActiveJobs::ViewOf(const ActiveJob& job) {
  v1::Job view = ToJob(job.record);
  view.set_state(job.running.has_value() ? v1::JOB_STATE_RUNNING : v1::JOB_STATE_QUEUED);
  view.set_memory_bytes(std::max(job.record.peak_bytes, job.estimate_bytes));
  view.set_coarse_ready(job.coarse_ready);
  if (job.running.has_value()) *view.mutable_progress() = job.progress;
  return view;
}

Notice ActiveJobs::Announce(const ActiveJob& job) {
  const auto watchers = watchers_.find(job.record.digest);
  Notice notice{{}, ViewOf(job), ++version_};
  if (watchers != watchers_.end()) notice.watchers = watchers->second;
  TellSinks(notice.job);
  return notice;
}

void ActiveJobs::TellSinks(const v1::Job& job) {
  for (JobSink* sink : sinks_) sink->Take(job);
}

void ActiveJobs::Enqueue(ActiveJob& job) {
  job.number = ++last_number_;
  if (job.waits_for.empty()) queue_.Add(EntryOf(job));
}

void ActiveJobs::Reserve(ActiveJob& job, uint64_t bytes) {
  reserved_bytes_ += bytes - job.reserved_bytes;
  job.reserved_bytes = bytes;
}

void ActiveJobs::EraseWatcher(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  const auto watchers = watchers_.find(digest);
  if (watchers == watchers_.end()) return;
  std::erase(watchers->second, watcher);
  if (watchers->second.empty()) watchers_.erase(watchers);
}

}  // namespace carillon
