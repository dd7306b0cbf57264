// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/base/clock.h"
#include "server/decomposition/active_jobs.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/job/wanted_job.h"
#include "server/decomposition/job_events.h"
#include "server/decomposition/job_journal.h"
#include "server/decomposition/job_runs.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/job_watch.h"
#include "server/decomposition/queue_settings.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

struct DecompositionJobPage {
  std::vector<v1::Job> jobs;
  std::string next_page_token;  ///< empty after the last page
};

/// Jobs that compute modal models and their transfers. Each job is computed once, however many
/// requests ask for it. The next daemon computes the accepted jobs of a daemon that died. Get, List
/// and Watch do not wait while the database writes. Safe from every thread.
///
/// A job that waits or runs is in `jobs_` and in the database; a job that has ended is in the
/// database only. What becomes of a job is decided by Transition (job_machine.h), which asks no
/// disk. Calls that change jobs hold the writer's lock of `runs_`; they store a change by
/// `journal_` before they show it in `jobs_`. Get, List, Watch and Forget lock only `jobs_`, whose
/// lock is never held during an access to the disk.
class DecompositionQueue {
 public:
  /// Queues the unfinished jobs of an earlier run of the daemon. `database` and `clock` must
  /// outlive the queue. The destructor ends running workers; the next start of the daemon runs
  /// their jobs. A model that the database puts into quarantine is computed again if it has a job.
  static absl::StatusOr<std::unique_ptr<DecompositionQueue>> Make(
      ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
      QueueSettings settings = {});
  ~DecompositionQueue();

  const QueueSettings& settings() const { return settings_; }

  /// Returns whether a material may become the material of the objects that name none.
  using MaterialCheck = std::function<bool(const std::string& model, const v1::Material& material)>;

  /// Requests the modal model of a mesh (ResolveRequest is applied). The job is in the database
  /// when the call returns. The job has succeeded at once if a stored model is complete up to the
  /// eigenvalue that the hints want; otherwise the model is computed again and replaced. If the job
  /// waits or runs already, it is returned, extended if this request wants more. If it failed for a
  /// reason that would recur, it is returned as failed. A job that failed by a crash, a stall, a
  /// time-out or a lack of memory is queued again. Errors: those of ResolveRequest, NotFound
  /// (MESH_NOT_FOUND), ResourceExhausted (QUEUE_FULL, CLIENT_LIMIT_REACHED). Clients, named by
  /// `client`, take turns. A job that several clients ask for counts for the first of them. The
  /// material of the request becomes the model's, unless there is a `check` that says no. If the
  /// client may not change pinned models, a request that would change one is refused:
  /// PermissionDenied (ROLE_MISSING).
  absl::StatusOr<v1::Job> Submit(const v1::CreateModalModelRequest& request,
                                 const std::string& client = {}, const MaterialCheck& check = {},
                                 bool may_change_pinned = true);

  /// Requests a transfer of the stored model `model`. The job has succeeded at once if a stored
  /// transfer satisfies the request. In all other respects the call works like Submit. Errors:
  /// InvalidArgument (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL), NotFound
  /// (MODAL_MODEL_NOT_FOUND), ResourceExhausted (QUEUE_FULL, CLIENT_LIMIT_REACHED).
  absl::StatusOr<v1::Job> SubmitTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request,
                                         const std::string& client = {},
                                         bool may_change_pinned = true);

  using Counts = QueueCounts;
  Counts counts();

  /// Returns a job. Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<v1::Job> Get(const std::string& digest);

  /// Returns the jobs that match, newest first, up to 1000 a page; a `page_size` of 0 means 100. A
  /// page may have fewer jobs than that even if more pages follow. Errors: InvalidArgument
  /// (INVALID_SETTINGS).
  absl::StatusOr<DecompositionJobPage> List(int page_size, const std::string& page_token,
                                            const JobFilter& filter = {});

  /// Cancels a queued or running job. A job that has ended stays unchanged. The answer shows a
  /// running job as still running; its watchers learn of its end. With `client`, the job goes on if
  /// other clients have asked for it that have not cancelled it. A client that has not asked for
  /// the job may only cancel it if nobody has since the queue was made. The transfer that follows a
  /// model is asked for by those that want the model. Errors: NotFound (JOB_NOT_FOUND),
  /// PermissionDenied (JOB_OF_ANOTHER).
  absl::StatusOr<v1::Job> Cancel(const std::string& digest,
                                 const std::optional<std::string>& client = std::nullopt);

  /// Calls `on_change` with the job at once and after every change, in order and one call at a
  /// time, until the job has ended. The calls are made on this thread or on a thread of the
  /// executor, without a lock of the queue, and must not block. Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<std::unique_ptr<JobWatch>> Watch(const std::string& digest,
                                                  std::function<void(const v1::Job&)> on_change);

  /// Gives `sink`, which must outlive the watch, all jobs that wait or run and then every change of
  /// every job.
  std::unique_ptr<JobWatch> WatchAll(JobSink& sink);

  /// Deletes the model `digest`, its transfers and all their jobs. Jobs that have not ended are
  /// cancelled first. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status DeleteModel(const std::string& digest);

 private:
  using Notices = JobRuns::Notices;

  DecompositionQueue(ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
                     QueueSettings settings);

  absl::Status TakeUp();
  absl::Status TakeUpJob(JobRecord record, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitAndTell(const WantedJob& wanted)
      ABSL_LOCKS_EXCLUDED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitAny(const WantedJob& wanted, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitNew(const WantedJob& wanted, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> SubmitAgain(const ActiveJob& active, const WantedJob& wanted)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void FollowByTransfer(const WantedJob& model, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::Status CheckAcceptable(const WantedJob& wanted)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  std::optional<v1::CreateModalModelRequest> CoarseOf(const WantedJob& fine);
  void CopyStoredCoarseModel(const WantedJob& fine) ABSL_LOCKS_EXCLUDED(runs_.writer());
  std::string StartCoarse(const WantedJob& fine, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::Status AddWish(const std::string& digest, const std::string& client)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void OnQuarantine(const std::string& digest, const absl::Status& why);
  bool ComputeAgain(const std::string& digest, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  void Drop(const std::string& digest, Notices& notices)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(runs_.writer());
  absl::StatusOr<v1::Job> FindStored(const std::string& digest);

  ModeDatabase& database_;
  const Clock& clock_;
  const QueueSettings settings_;
  JobEvents events_;
  JobJournal journal_;
  const std::shared_ptr<ActiveJobs> jobs_;  ///< watches, which may outlive the queue, know it, too
  JobRuns runs_;
};

}  // namespace carillon
