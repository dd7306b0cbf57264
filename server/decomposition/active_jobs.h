// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "carillon/v1/decomposition.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/decomposition/fair_queue.h"
#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/job_machine.h"
#include "server/decomposition/job_places.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/job_watchers.h"
#include "server/decomposition/watcher.h"

namespace carillon {

/// Has all jobs that wait or run in memory, and tells whoever watches them. No call waits for a
/// disk, so readers and progress reports are served while the database is busy. Safe from every
/// thread; one thread at a time adds, starts and changes jobs. A call that returns a Notice has not
/// called the watchers: the caller sends the notice after it has released its locks.
class ActiveJobs {
 public:
  /// `experience` corrects the memory estimates of decompositions.
  explicit ActiveJobs(const JobCapacity& capacity,
                      const MemoryExperience& experience = MemoryExperience());

  std::optional<ActiveJob> Find(const std::string& digest);
  bool Contains(const std::string& digest);
  /// Returns the jobs that `wanted` is true of.
  std::vector<ActiveJob> Select(absl::FunctionRef<bool(const ActiveJob&)> wanted);

  struct Counts {
    size_t queued = 0;  ///< those that wait for a coarse model too
    size_t running = 0;
    size_t in_queue = 0;  ///< for a worker and memory
    size_t in_queue_of_client = 0;
  };
  Counts Count(const std::string& client = {});

  /// Returns a job as clients see it, or nothing if it neither waits nor runs.
  std::optional<v1::Job> View(const std::string& digest);
  /// Returns all jobs as clients see them at one moment, by digest.
  std::map<std::string, v1::Job> ViewAll();

  /// Appends a job to its client's queue, behind those of its priority. Its memory is predicted
  /// from `guess_bytes`, which experience corrects for decompositions, or known from an earlier
  /// run.
  void Add(ActiveJob job);

  /// Applies Transition to a job and does what follows from it here: the job moves to the place in
  /// the queue that it then has, or is removed, and its watchers learn of it. The caller ends runs
  /// and has stored what must be stored.
  Notice Apply(const std::string& digest, const JobEvent& event);

  /// Marks the next decomposition, or else the next transfer, as running if a worker and the memory
  /// for it are free (JobPlaces). No other job overtakes a job that waits for memory, because small
  /// jobs could delay a large one for ever.
  std::optional<ActiveJob> BeginRun(const Clock& clock);

  /// Returns the news of a run that has begun and is stored.
  Notice AnnounceRun(const std::string& digest);

  /// Returns the digests of running transfers to cancel, so that the next decomposition gets their
  /// memory. They are marked as yielding, except those that are to end
  /// anyway.
  std::vector<std::string> BeginYielding();

  /// Records the progress of a run. The node count of the mesh, once it is known, predicts the
  /// memory better than the size of the file.
  Notice Report(const std::string& digest, const v1::Progress& progress);

  /// Frees the worker and the memory of a run that has ended. Experience learns from the memory
  /// that a decomposition took, unless `peak_bytes` is 0. The job still counts as running until
  /// Apply(RunEnded).
  ActiveJob EndRun(const std::string& digest, uint64_t peak_bytes = 0);

  /// Returns the news for the watchers of waiting jobs after other jobs have started or ended.
  std::vector<Notice> NewsOfWaiting();

  MemoryExperience experience();

  /// Registers a watcher of a digest, whether its job is active or not. If the job is not active,
  /// the notice has a job without a name, and the caller must complete the notice by CompleteWatch.
  Notice Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  /// Returns the first notice of a watch whose job was not active. `stored` is the job as the
  /// database has it after the call of Watch. An ended job has no further news, so its watcher is
  /// forgotten.
  Notice CompleteWatch(const std::string& digest, Notice watch, const v1::Job& stored);
  void Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher);

  /// Hands all jobs to `sink`, then every change until Forget.
  void WatchAll(JobSink& sink);
  /// Ends WatchAll for `sink`. When Forget returns, no call of `sink` runs, and none follows.
  void Forget(JobSink& sink);
  /// Tells the sinks of a job that is new and has ended already.
  void TellEnded(const v1::Job& job);

 private:
  static FairQueue::Entry EntryOf(const ActiveJob& job);
  FairQueue& QueueOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  FairQueue& QueueOf(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::WaitCause WaitCauseOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::JobWait WaitOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::Job ViewOf(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ForEachWaiting(absl::FunctionRef<void(const ActiveJob&, const v1::JobWait&)> visit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ForEachView(absl::FunctionRef<void(const ActiveJob&, const v1::Job&)> visit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mutex mutex_;
  std::map<std::string, ActiveJob> jobs_ ABSL_GUARDED_BY(mutex_);
  FairQueue decompositions_ ABSL_GUARDED_BY(mutex_);  ///< the waiting decompositions
  FairQueue transfers_ ABSL_GUARDED_BY(mutex_);       ///< the waiting transfers
  JobPlaces places_ ABSL_GUARDED_BY(mutex_);
  JobWatchers watchers_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_number_ ABSL_GUARDED_BY(mutex_) = 0;
  MemoryExperience experience_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
