// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/decomposition/fair_queue.h"
#include "server/decomposition/job_places.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/job_wishes.h"
#include "server/decomposition/memory_estimate.h"
#include "server/decomposition/watcher.h"
#include "server/mode_database/job_store.h"

namespace carillon {

/// A job that waits or runs.
struct ActiveJob {
  JobRecord record;                     ///< as the database has it
  v1::CreateModalModelRequest request;  ///< the request so far that reaches farthest
  std::optional<v1::CreateModalModelRequest> running{};  ///< the request that its run was given
  v1::Progress progress{};                               ///< of the run
  /// The client in whose queue the job is. It is empty if no client is known to want the job.
  std::string client{};
  JobWishes wishes{};           ///< the clients that want the job
  std::string waits_for{};      ///< digest of the coarse model's job, until that job has ended
  bool coarse_ready = false;    ///< a coarse model is stored under the job's digest
  bool yields = false;          ///< its run is ended to make room, and repeated
  bool again = false;           ///< submitted after a cancel: it runs once more after this run
  bool deleted = false;         ///< its model was deleted: the result is not stored
  bool was_killed = false;      ///< somebody else ended its worker once
  uint64_t number = 0;          ///< order in which jobs of one priority start
  uint64_t guess_bytes = 0;     ///< predicted memory, before the correction by experience
  uint64_t estimate_bytes = 0;  ///< predicted memory
  std::chrono::nanoseconds started{};  ///< monotonic clock at the start of the run
  int64_t started_unix_ms = 0;         ///< at the start of the run
};

/// Has all jobs that wait or run, and all watchers of jobs, in memory. No call waits for a disk, so
/// readers and progress reports are served while the database is busy. Safe from every thread; one
/// thread at a time adds, removes and changes jobs. A call that returns a Notice has not called the
/// watchers: the caller sends the notice after it has released its locks.
class ActiveJobs {
 public:
  /// Sets the limits of running jobs. The caller must call it before BeginRun.
  void SetCapacity(const JobCapacity& capacity);

  std::optional<ActiveJob> Find(const std::string& digest);
  bool Contains(const std::string& digest);
  size_t queued_count();
  /// Returns the number of queued jobs of one client.
  size_t queued_count(const std::string& client);
  /// The numbers of jobs that wait and that run.
  struct Counts {
    size_t queued = 0;
    size_t running = 0;
  };
  Counts CountStates();
  std::vector<ActiveJob> Running();
  /// Returns the digests of the jobs that compute transfers of the model.
  std::vector<std::string> TransfersOf(const std::string& model);
  /// Returns the digests of the jobs that wait for the coarse model's job `coarse`.
  std::vector<std::string> WaitingFor(const std::string& coarse);

  /// Returns a job as clients see it, or nothing if it neither waits nor runs.
  std::optional<v1::Job> View(const std::string& digest);
  /// Returns all jobs as clients see them at one moment, by digest.
  std::map<std::string, v1::Job> ViewAll();

  /// Appends a job to its client's queue, behind those of its priority. Its memory is predicted
  /// from `guess_bytes`, which experience corrects for decompositions, or known from an earlier
  /// run.
  void Add(ActiveJob job);

  /// Applies `change` to a job. A waiting job moves to the place in the queue that it then has.
  Notice Change(const std::string& digest, absl::FunctionRef<void(ActiveJob&)> change);

  /// Notes that a client, too, wants a job, if the job waits or runs.
  void AddWish(const std::string& digest, const std::string& client);

  /// Removes a job. Its watchers get `last`.
  Notice Remove(const std::string& digest, const v1::Job& last);

  /// Marks the next decomposition, or else the next transfer, as running if a worker and the memory
  /// for it are free (JobPlaces). No other job overtakes a job that waits for memory, because small
  /// jobs could delay a large one for ever.
  std::optional<ActiveJob> BeginRun(const Clock& clock);

  /// Returns the digests of running transfers to cancel, so that the next decomposition gets their
  /// memory. They are marked as yielding.
  std::vector<std::string> BeginYielding();

  /// Records the progress of a run. The node count of the mesh, once it is known, predicts the
  /// memory better than the size of the file.
  Notice Report(const std::string& digest, const v1::Progress& progress);

  /// Frees the worker and the memory of a run that has ended. The job still counts as running for
  /// readers, until it is removed or queued again.
  ActiveJob EndRun(const std::string& digest);

  /// Returns the news for the watchers of waiting jobs after other jobs have started or ended.
  std::vector<Notice> NewsOfWaiting();

  /// Queues a job again whose run has ended, behind those of its priority.
  Notice QueueAgain(ActiveJob job);

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

  void SetExperience(const MemoryExperience& experience);
  /// Compares the memory of a run with its guess. Returns the correction of guesses from now on.
  double Learn(uint64_t guess_bytes, uint64_t peak_bytes);

 private:
  static FairQueue::Entry EntryOf(const ActiveJob& job);
  FairQueue& QueueOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  FairQueue& QueueOf(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  size_t EarlierCount(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::WaitCause WaitCauseOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::JobWait WaitOf(v1::JobKind kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::Job ViewOf(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ForEachWaiting(absl::FunctionRef<void(const ActiveJob&, const v1::JobWait&)> visit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ForEachView(absl::FunctionRef<void(const ActiveJob&, const v1::Job&)> visit)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void TellSinks(const v1::Job& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Notice Announce(const ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Enqueue(ActiveJob& job) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EraseWatcher(const std::string& digest, const std::shared_ptr<Watcher>& watcher)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Mutex mutex_;
  std::map<std::string, ActiveJob> jobs_ ABSL_GUARDED_BY(mutex_);
  FairQueue decompositions_ ABSL_GUARDED_BY(mutex_);  ///< the waiting decompositions
  FairQueue transfers_ ABSL_GUARDED_BY(mutex_);       ///< the waiting transfers
  JobPlaces places_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::vector<std::shared_ptr<Watcher>>> watchers_ ABSL_GUARDED_BY(mutex_);
  std::set<JobSink*> sinks_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_number_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t version_ ABSL_GUARDED_BY(mutex_) = 0;
  MemoryExperience experience_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
