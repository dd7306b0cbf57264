// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/memory_estimate.h"
#include "server/decomposition/watcher.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// What DecompositionQueue does; its calls are documented there.
///
/// Invariants: a job that waits or runs is in `active_` and as JOB_STATE_QUEUED in the database;
/// one that has ended is in the database only. Running jobs stay JOB_STATE_QUEUED there: a daemon
/// that starts has to run them anyway.
class QueueCore {
 public:
  QueueCore(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
            QueueSettings settings)
      : database_(database),
        clock_(clock),
        settings_(std::move(settings)),
        executor_(std::move(executor)) {}

  /// Queues what an earlier run of the daemon left.
  absl::Status TakeUp();
  /// Ends running children; nothing is told afterwards.
  void Stop();

  absl::StatusOr<v1::Job> Submit(const v1::CreateModalModelRequest& request);
  absl::StatusOr<v1::Job> Get(const std::string& digest);
  absl::StatusOr<DecompositionJobPage> List(int page_size, const std::string& page_token);
  absl::StatusOr<v1::Job> Cancel(const std::string& digest);
  absl::Status DeleteModel(const std::string& digest);
  absl::Status Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  void Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher);

 private:
  /// A job that waits or runs.
  struct Active {
    JobRecord record;
    v1::CreateModalModelRequest request;                 // the farthest reaching one so far
    std::optional<v1::CreateModalModelRequest> running;  // as it was started
    v1::Progress progress;
    std::string waits_for;        // digest of the coarse model's job, until that has ended
    bool coarse_ready = false;    // a coarse model is there under the name
    bool again = false;           // asked for anew after a cancel: to be started once more
    bool deleted = false;         // its result is no longer wanted
    uint64_t number = 0;          // among those that wait
    uint64_t guess_bytes = 0;     // of memory, before any correction
    uint64_t estimate_bytes = 0;  // of memory
    uint64_t reserved_bytes = 0;  // while it runs
    std::chrono::nanoseconds started{};
    std::vector<std::shared_ptr<Watcher>> watchers;
  };
  using Notices = std::vector<Notice>;
  /// In the queue: by priority, highest first, then by number.
  using Place = std::tuple<int32_t, uint64_t, std::string>;

  absl::StatusOr<v1::Job> SubmitNew(const std::string& digest,
                                    const v1::CreateModalModelRequest& request, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<v1::Job> SubmitAgain(Active& active, const v1::CreateModalModelRequest& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<bool> IsSatisfied(const std::optional<JobRecord>& record,
                                   const std::string& digest,
                                   const v1::CreateModalModelRequest& request);
  std::string StartCoarse(const std::string& digest, const v1::CreateModalModelRequest& request,
                          Notices& notices) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ReleaseWaiting(const std::string& coarse, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool HasCoarse(const std::string& digest, const v1::CreateModalModelRequest& request);
  void Enqueue(JobRecord record, v1::CreateModalModelRequest request, std::string waits_for = {})
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void OnQuarantine(const std::string& digest, const absl::Status& why);
  bool ComputeAgain(const std::string& digest, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void StartWhatFits(Notices& notices) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Requeue(Active& active) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static Place PlaceOf(const Active& active);
  void Reserve(Active& active, uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  DecompositionTask MakeTask(const Active& active);

  void OnProgress(const std::string& digest, const v1::Progress& progress);
  void OnEnd(const std::string& digest, const Outcome& outcome);
  Outcome Store(const std::string& digest, const Outcome& outcome);
  bool RunAgain(Active& active, const Outcome& outcome) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Notice Finish(Active& active, const Outcome& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LearnFrom(Active& active, const Outcome& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Notice Announce(const Active& active) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  v1::Job ActiveJob(const Active& active) const;
  absl::StatusOr<v1::Job> FindJob(const std::string& digest) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  ModeDatabase& database_;
  const Clock& clock_;
  const QueueSettings settings_;
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::map<std::string, Active> active_ ABSL_GUARDED_BY(mutex_);
  std::set<Place> queued_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_number_ ABSL_GUARDED_BY(mutex_) = 0;
  int running_count_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t reserved_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  MemoryExperience experience_ ABSL_GUARDED_BY(mutex_);
  double mean_run_s_ ABSL_GUARDED_BY(mutex_) = 10;  // before anything was seen
  uint64_t version_ ABSL_GUARDED_BY(mutex_) = 0;
  std::unique_ptr<Executor> executor_;
};

}  // namespace carillon
