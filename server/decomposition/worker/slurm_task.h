// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/worker/slurm_options.h"
#include "server/decomposition/worker/slurm_queue.h"

namespace carillon {

/// The files of one decomposition, in a folder that the cluster shares:
///
///     ticket     the name of this submission
///     request    worker::v1::WorkerRequest as text; if another one is due, the folder is made anew
///     mesh
///     begun.R    a run R has begun        events.R   what it reported
///     log.R      its standard error       model.R    its result
///     end        "R STATUS": the first run to end; the others' links fail
///
/// Only one thread at a time may use an object.
class SlurmTask {
 public:
  /// Makes the folder, or takes over a folder with the same request that an earlier daemon left.
  /// Errors: those of write_input, FailedPrecondition (DATABASE_UNUSABLE).
  static absl::StatusOr<SlurmTask> Prepare(DecompositionTask task,
                                           const SlurmExecutorOptions& options);

  const DecompositionTask& task() const { return task_; }
  const SlurmJob& job() const { return job_; }

  /// Returns the job to submit, with a new ticket. Errors: FailedPrecondition (DATABASE_UNUSABLE).
  absl::StatusOr<SlurmJob> NextSubmission();

  /// Calls on_progress with the progress that runs have reported since the last call.
  void ReadProgress();

  /// Returns the outcome once a run has ended.
  std::optional<Outcome> TakeEnd() const;

  /// Returns the outcome of a job that left the queue without a result, if another run would not
  /// succeed either.
  std::optional<Outcome> JudgeLoss(std::optional<SlurmState> state) const;

  /// Removes the folder.
  void Remove() const;

 private:
  SlurmTask(DecompositionTask task, const SlurmExecutorOptions& options)
      : task_(std::move(task)), options_(&options), folder_(options.directory / task_.digest) {}

  absl::Status MakeFolder(const std::string& request);
  int RunCount() const;

  DecompositionTask task_;
  const SlurmExecutorOptions* options_;
  std::filesystem::path folder_;
  SlurmJob job_;
  std::string progress_bytes_;  // the newest reported progress, serialized
  double fraction_ = 0;
};

}  // namespace carillon
