// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/decomposition/active_jobs.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/job_events.h"
#include "server/decomposition/job_wishes.h"
#include "server/decomposition/phase_usage.h"
#include "server/decomposition/watcher.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// The origin of a job, with the fields of ActiveJob that have the same names.
struct JobOrigin {
  std::string client{};
  JobWishes wishes{};
  std::string waits_for{};
};

/// Starts queued jobs on the executor, stores their results and queues the jobs that follow.
class JobRuns {
 public:
  using Notices = std::vector<Notice>;

  /// `database`, `clock` and `jobs` must outlive the object.
  JobRuns(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
          ActiveJobs& jobs, QueueSettings settings);

  /// Returns the mutex of the one thread that writes jobs into the database and into `jobs`. The
  /// thread also holds it while it waits for the disk. Readers never lock it.
  Mutex& writer() ABSL_LOCK_RETURNED(writer_) { return writer_; }

  /// Restores the correction of memory estimates that earlier runs of the daemon learnt.
  void RecallExperience();

  /// Ends the running workers; no job changes afterwards.
  void Stop();

  /// Adds a job to the queue. The caller has stored the job's record.
  void Enqueue(JobRecord record, v1::CreateModalModelRequest request, JobOrigin origin = {})
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Starts jobs while workers and memory are free. Ends transfers whose memory the next
  /// decomposition needs; they are computed later.
  void StartWhatFits(Notices& notices) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Ends the worker of a running job. The job ends, or is queued again, when the worker has ended.
  void Cancel(const std::string& digest) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Queues the jobs that waited for the coarse model's job `coarse`, which has ended successfully
  /// or not. The coarse model, if there is one, is copied under their digests.
  void ReleaseWaiting(const std::string& coarse, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  JobEvents& events() { return events_; }

  /// Returns the numbers of ended runs by the outcome of their jobs, and the cost of each phase.
  DecompositionQueue::Counts ended();

  /// Returns the mean time until a place in a full queue becomes free, in seconds.
  double retry_after_s() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_) {
    return mean_run_s_ / worker_count_;
  }

 private:
  void OnProgress(const std::string& digest, const v1::Progress& progress);
  DecompositionTask MakeTask(const ActiveJob& job);
  void OnEnd(const std::string& digest, const Outcome& outcome);
  Outcome Store(const std::string& digest, const Outcome& outcome);
  absl::Status PutResult(const JobRecord& job, const std::filesystem::path& file);
  bool stops() const ABSL_LOCKS_EXCLUDED(writer_);
  void FollowByTransfer(const ActiveJob& model) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  bool RunsAgain(ActiveJob& job, const Outcome& result) const;
  void CountEnd(v1::JobState state);
  Notice Finish(ActiveJob job, const Outcome& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  void LearnFrom(ActiveJob& job, const Outcome& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  ModeDatabase& database_;
  const Clock& clock_;
  ActiveJobs& jobs_;
  const QueueSettings settings_;
  JobEvents events_;
  mutable Mutex writer_;
  Mutex ended_mutex_ ABSL_ACQUIRED_AFTER(writer_);
  bool stopping_ ABSL_GUARDED_BY(writer_) = false;
  double mean_run_s_ ABSL_GUARDED_BY(writer_) = 10;  // a guess until a run has ended
  DecompositionQueue::Counts ended_ ABSL_GUARDED_BY(ended_mutex_);
  PhaseUsage phases_;
  std::unique_ptr<Executor> executor_;
  const int worker_count_;
};

}  // namespace carillon
