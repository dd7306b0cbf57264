// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/base/clock.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/phase_usage.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

class QueueCore;

/// Ends a watch when it is destroyed: its function is not running then and is never called again.
/// The function itself may destroy it. The caller must hold no lock that the function takes.
class JobWatch {
 public:
  virtual ~JobWatch() = default;
};

struct QueueSettings {
  size_t max_queued_count = 1024;
  size_t max_queued_count_of_client = 512;
  /// Whether a transfer is computed of each model after it, unless the request leaves it out.
  bool transfers = false;
  /// Takes log lines about events of which no caller learns. Any thread calls it.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
};

struct DecompositionJobPage {
  std::vector<v1::Job> jobs;
  std::string next_page_token;  ///< empty: this was the last page
};

/// Jobs that compute modal models and their transfers. Each is computed once, however many requests
/// ask for it, and an accepted job is computed even if the daemon dies in between. Get, List and
/// Watch do not wait while the database writes. Safe from every thread.
class DecompositionQueue {
 public:
  /// Queues the unfinished jobs of an earlier run of the daemon. `database` and `clock` must
  /// outlive the queue. The destructor ends running workers and leaves their jobs to the next
  /// start. A model that the database puts into quarantine is computed again if it has a job.
  static absl::StatusOr<std::unique_ptr<DecompositionQueue>> Make(
      ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
      QueueSettings settings = {});
  ~DecompositionQueue();

  const QueueSettings& settings() const;

  /// Requests the modal model of a mesh (ResolveRequest is applied). The job is in the database
  /// when the call returns.
  /// The job has succeeded at once if a stored model is complete up to the eigenvalue that the
  /// hints want; otherwise the model is computed again and replaced. A job that waits or runs is
  /// returned, extended if this request wants more. A job that failed for a reason that would recur
  /// has failed at once; after a crash, a stall, a time-out or a lack of memory it is queued again.
  /// Errors: those of ResolveRequest, NotFound (MESH_NOT_FOUND), ResourceExhausted (QUEUE_FULL,
  /// CLIENT_LIMIT_REACHED).
  /// Clients, named by `client`, take turns. A job that several ask for is the first one's.
  absl::StatusOr<v1::Job> Submit(const v1::CreateModalModelRequest& request,
                                 const std::string& client = {});

  /// Requests a transfer of the stored model `model`. The job has succeeded at once if a transfer
  /// is stored that serves the request. The rest is as for Submit. Errors: InvalidArgument
  /// (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL), NotFound (MODAL_MODEL_NOT_FOUND),
  /// ResourceExhausted (QUEUE_FULL, CLIENT_LIMIT_REACHED).
  absl::StatusOr<v1::Job> SubmitTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request,
                                         const std::string& client = {});

  /// Jobs that wait and run, and those that have ended since this was made.
  struct Counts {
    size_t queued = 0;
    size_t running = 0;
    uint64_t succeeded = 0;
    uint64_t failed = 0;
    uint64_t cancelled = 0;
    PhaseUses phases{};
  };
  Counts counts();

  /// Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<v1::Job> Get(const std::string& digest);

  /// Those that match, newest first. `page_size` 0: 100; at most 1000. A page may have fewer
  /// although others follow. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<DecompositionJobPage> List(int page_size, const std::string& page_token,
                                            const JobFilter& filter = {});

  /// Cancels a queued or running job; a job that has ended stays unchanged. A running job is still
  /// running in the answer; its watchers learn of its end. Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<v1::Job> Cancel(const std::string& digest);

  /// Calls `on_change` with the job at once and after every change, in order and one call at a
  /// time; the job of the last call has ended. The calls come on this thread or on one of the
  /// executor, with no lock of the queue held, and must not block. Errors: NotFound
  /// (JOB_NOT_FOUND).
  absl::StatusOr<std::unique_ptr<JobWatch>> Watch(const std::string& digest,
                                                  std::function<void(const v1::Job&)> on_change);

  /// Hands all jobs that wait or run to `sink`, which must outlive the watch, then every change of
  /// every job.
  std::unique_ptr<JobWatch> WatchAll(JobSink& sink);

  /// Deletes the model of that digest, its transfers and their jobs, which are cancelled if they
  /// have not ended.
  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status DeleteModel(const std::string& digest);

 private:
  explicit DecompositionQueue(std::shared_ptr<QueueCore> core);

  std::shared_ptr<QueueCore> core_;
};

}  // namespace carillon
