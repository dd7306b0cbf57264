// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/base/clock.h"
#include "server/decomposition/active_jobs.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/job_runs.h"
#include "server/decomposition/wanted_job.h"
#include "server/decomposition/watcher.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// Implements DecompositionQueue, whose calls are documented there.
///
/// A job that waits or runs is in `jobs_` and in the database; a job that has ended is in the
/// database only. The database has running jobs as JOB_STATE_QUEUED, too, because the next daemon
/// has to run them again.
///
/// Calls that change jobs hold the writer's lock of `runs_`, also while the database writes. They
/// store a change before they show it in `jobs_`. Get, List, Watch and Forget lock only `jobs_`,
/// whose lock is never held during an access to the disk.
class QueueCore {
 public:
  QueueCore(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
            QueueSettings settings)
      : database_(database),
        clock_(clock),
        settings_(std::move(settings)),
        runs_(database, std::move(executor), clock, jobs_, settings_) {}

  const QueueSettings& settings() const { return settings_; }

  /// Queues the unfinished jobs of an earlier run of the daemon.
  absl::Status TakeUp();
  /// Ends running workers. Watchers learn of no change afterwards.
  void Stop();

  absl::StatusOr<v1::Job> Submit(const v1::CreateModalModelRequest& request,
                                 const std::string& client,
                                 const DecompositionQueue::MaterialCheck& check,
                                 bool may_change_pinned);
  absl::StatusOr<v1::Job> SubmitTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request,
                                         const std::string& client, bool may_change_pinned);
  DecompositionQueue::Counts counts();
  absl::StatusOr<v1::Job> Get(const std::string& digest);
  absl::StatusOr<DecompositionJobPage> List(int page_size, const std::string& page_token,
                                            const JobFilter& filter);
  absl::StatusOr<v1::Job> Cancel(const std::string& digest,
                                 const std::optional<std::string>& client);
  absl::Status DeleteModel(const std::string& digest);
  absl::Status Watch(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  void Forget(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  void WatchAll(JobSink& sink) { jobs_.WatchAll(sink); }
  void Forget(JobSink& sink) { jobs_.Forget(sink); }

 private:
  using Notices = JobRuns::Notices;

  absl::Status TakeUpJob(JobRecord record, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitAny(const WantedJob& wanted, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitNew(const WantedJob& wanted, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void FollowByTransfer(const WantedJob& model, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::Status CheckAcceptable(const WantedJob& wanted)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitAgain(const ActiveJob& active, const WantedJob& wanted)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  std::string StartCoarse(const WantedJob& fine, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  JobWishes StoredWishes(const std::string& digest);
  /// Notes that a client wants a job that waits or runs.
  absl::Status AddWish(const std::string& digest, const std::string& client)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<bool> Withdraw(const ActiveJob& active, const std::string& client)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void OnQuarantine(const std::string& digest, const absl::Status& why);
  bool ComputeAgain(const std::string& digest, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void Drop(const std::string& digest, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void EndQueued(const JobRecord& record, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> FindStored(const std::string& digest);

  ModeDatabase& database_;
  const Clock& clock_;
  const QueueSettings settings_;
  ActiveJobs jobs_;
  JobRuns runs_;
};

}  // namespace carillon
