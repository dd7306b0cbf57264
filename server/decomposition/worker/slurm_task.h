// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/worker/remote_runs.h"
#include "server/decomposition/worker/slurm_options.h"
#include "server/decomposition/worker/slurm_queue.h"

namespace carillon {

/// The files of one decomposition, in a folder that the cluster shares or that RemoteRuns fills:
///
///     ticket     the name of this submission, and the hash of its token if it has one
///     request    worker::v1::WorkerRequest as text; if it differs from the current request, the
///     folder is
///                made anew
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
                                           const SlurmExecutorOptions& options, RemoteRuns& runs);

  const DecompositionTask& task() const { return task_; }
  const SlurmJob& job() const { return job_; }

  /// Returns the job to submit, with a new ticket. If the run of the job will upload its result,
  /// the job also has a new token, and the tokens of earlier submissions become invalid. Errors:
  /// FailedPrecondition (DATABASE_UNUSABLE).
  absl::StatusOr<SlurmJob> NextSubmission();

  /// Calls on_progress with the progress that runs have reported since the last call.
  void ReadProgress();

  /// Returns the outcome once a run has ended.
  std::optional<Outcome> TakeEnd() const;

  /// Returns the outcome of a job that left the queue without a result, if another run would not
  /// succeed either.
  std::optional<Outcome> JudgeLoss(std::optional<SlurmState> state) const;

  /// Refuses further uploads of the task's runs, and removes the folder.
  void Remove() const;

  /// Admits the runs of jobs that an earlier daemon left in `directory`. The caller must call it
  /// before any task is prepared.
  static void AdmitLeft(const std::filesystem::path& directory, RemoteRuns& runs);

 private:
  SlurmTask(DecompositionTask task, const SlurmExecutorOptions& options, RemoteRuns& runs)
      : task_(std::move(task)),
        options_(&options),
        runs_(&runs),
        folder_(options.directory / task_.digest) {}

  absl::Status MakeFolder(const std::string& request);
  bool uploads() const { return !options_->upload.address.empty(); }
  int RunCount() const;
  std::string NotBegun() const;

  DecompositionTask task_;
  const SlurmExecutorOptions* options_;
  RemoteRuns* runs_;
  std::filesystem::path folder_;
  SlurmJob job_;
  std::string progress_bytes_;  // the newest reported progress, serialized
  double fraction_ = 0;
};

}  // namespace carillon
