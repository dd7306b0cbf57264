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
#include "server/decomposition/job/executor.h"
#include "server/decomposition/job/wanted_job.h"
#include "server/decomposition/job_events.h"
#include "server/decomposition/job_journal.h"
#include "server/decomposition/job_wishes.h"
#include "server/decomposition/phase_usage.h"
#include "server/decomposition/queue_settings.h"
#include "server/decomposition/watcher.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// The origin of a job, with the fields of ActiveJob that have the same names.
struct JobOrigin {
  std::string client{};
  JobWishes wishes{};
  std::string waits_for{};
};

/// Starts queued jobs on the executor, stores their results and queues the jobs that follow. A job
/// runs until its result and its end are stored, so both wait for space on the disk, and keep the
/// executor's thread for files.
class JobRuns {
 public:
  using Notices = std::vector<Notice>;

  /// All references must outlive the object.
  JobRuns(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
          ActiveJobs& jobs, JobJournal& journal, JobEvents& events, const QueueSettings& settings);

  /// Returns the mutex of the one thread that changes jobs in the database and in `jobs`. The
  /// thread also holds it while it waits for the disk, but for no longer than the write of a row.
  /// Readers never lock it.
  Mutex& writer() ABSL_LOCK_RETURNED(writer_) { return writer_; }

  /// Ends the running workers; no job changes afterwards.
  void Stop();

  /// Adds a job to the queue. The caller has stored the job's record.
  void Enqueue(JobRecord record, v1::CreateModalModelRequest request, JobOrigin origin = {})
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Starts jobs while workers and memory are free. Ends transfers whose memory the next
  /// decomposition needs; they are computed later.
  void StartWhatFits(Notices& notices) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Ends the worker of a running job. The job ends, or is queued again, when the worker has ended.
  void StopRun(const std::string& digest) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Does what follows from the end of a job, successful or not: the jobs that waited for its
  /// coarse model enter the queue, and what now fits starts.
  void GoOnAfter(const std::string& ended, Notices& notices) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  /// Returns the numbers of ended runs by the outcome of their jobs, and the cost of each phase.
  QueueCounts ended();

  /// Returns the mean time until a place in a full queue becomes free, in seconds.
  double retry_after_s() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_) {
    return mean_run_s_ / worker_count_;
  }

 private:
  /// What the store of a result leaves to be computed.
  struct Lost {
    std::vector<v1::TransferHeader> transfers;  ///< of the model's older revision
    bool queued = false;                        ///< whether all transfers are in the queue
  };

  void OnProgress(const std::string& digest, const v1::Progress& progress);
  DecompositionTask MakeTask(const ActiveJob& job);
  void OnEnd(const std::string& digest, const Outcome& outcome);
  absl::Status TryEnd(const std::string& digest, const RunEnded& end, Lost& lost, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  absl::Status StoreEnd(const ActiveJob& job, const JobRecord& ended, Lost& lost)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  std::vector<v1::TransferHeader> TransfersOf(const std::string& model);
  void CountEnd(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  void CopyToWaiting(const std::string& coarse) ABSL_LOCKS_EXCLUDED(writer_);
  void ReleaseWaiting(const std::string& coarse, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  Outcome Store(const std::string& digest, const Outcome& outcome);
  absl::Status PutResult(const JobRecord& job, const std::filesystem::path& file);
  bool stops() const ABSL_LOCKS_EXCLUDED(writer_);
  absl::Status FollowByTransfers(const ActiveJob& model, const Lost& lost)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);
  absl::Status FollowByTransfer(const ActiveJob& model, WantedJob wanted)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_);

  ModeDatabase& database_;
  const Clock& clock_;
  ActiveJobs& jobs_;
  JobJournal& journal_;
  JobEvents& events_;
  const QueueSettings& settings_;
  mutable Mutex writer_;
  Mutex ended_mutex_ ABSL_ACQUIRED_AFTER(writer_);
  bool stopping_ ABSL_GUARDED_BY(writer_) = false;
  double mean_run_s_ ABSL_GUARDED_BY(writer_) = 10;  // a guess until a run has ended
  QueueCounts ended_ ABSL_GUARDED_BY(ended_mutex_);
  PhaseUsage phases_;
  std::unique_ptr<Executor> executor_;
  const int worker_count_;
};

}  // namespace carillon
