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
#include "server/mode_database/mode_database.h"

namespace carillon {

class QueueCore;

/// Ends a watch when it is destroyed: afterwards its function neither runs nor will run. May be
/// destroyed within that function; the destroyer must hold no lock that the function takes.
class JobWatch {
 public:
  virtual ~JobWatch() = default;
};

struct QueueSettings {
  size_t max_queued_count = 1024;
  /// What people should know though no caller is told: a line each. Called on any thread.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
};

struct DecompositionJobPage {
  std::vector<v1::Job> jobs;
  std::string next_page_token;  ///< empty: this was the last page
};

/// Decomposition jobs: each body is computed once, whoever asks and however often, and what was
/// accepted is computed even if the daemon dies meanwhile. Safe from every thread.
class DecompositionQueue {
 public:
  /// Takes up the jobs that an earlier run of the daemon left. `database` and `clock` must outlive
  /// the queue. Its destruction ends running children and keeps their jobs for the next start. A
  /// model that the database puts into quarantine is computed again, where it has a job.
  static absl::StatusOr<std::unique_ptr<DecompositionQueue>> Make(
      ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
      QueueSettings settings = {});
  ~DecompositionQueue();

  /// Asks for the modal model of a mesh (ResolveRequest is applied). The job is in the database
  /// when the call returns. A model that is complete up to what the hints want: succeeded at once.
  /// Not that far: computed again, and replaced. Queued or running: that job, extended where this
  /// request wants more. Refused earlier for a reason that would come again: failed at once; a
  /// crash, a stall, a time-out or too little memory is tried again. Errors: those of
  /// ResolveRequest, NotFound (MESH_NOT_FOUND), ResourceExhausted (QUEUE_FULL).
  absl::StatusOr<v1::Job> Submit(const v1::CreateModalModelRequest& request);

  /// Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<v1::Job> Get(const std::string& digest);

  /// Newest first. `page_size` 0: 100; at most 1000. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<DecompositionJobPage> List(int page_size, const std::string& page_token);

  /// Cancels a queued or running job; one that has ended stays as it is. A running job is still
  /// running in the answer: watch it to see its end. Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<v1::Job> Cancel(const std::string& digest);

  /// Calls `on_change` with the job at once, then after every change, in order, never two calls at
  /// a time; the last call has a state that is an end. It runs on this thread or the executor's,
  /// with no lock of the queue held, and must not block. Errors: NotFound (JOB_NOT_FOUND).
  absl::StatusOr<std::unique_ptr<JobWatch>> Watch(const std::string& digest,
                                                  std::function<void(const v1::Job&)> on_change);

  /// Deletes the model of that digest and its job, which is cancelled if it has not ended.
  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status DeleteModel(const std::string& digest);

 private:
  explicit DecompositionQueue(std::shared_ptr<QueueCore> core);

  std::shared_ptr<QueueCore> core_;
};

}  // namespace carillon
