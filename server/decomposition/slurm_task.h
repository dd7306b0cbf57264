// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/remote_runs.h"
#include "server/decomposition/slurm_executor.h"
#include "server/decomposition/slurm_queue.h"

namespace carillon {

/// One decomposition in a folder that the cluster shares, or that RemoteRuns fills for it:
///
///     ticket     the name of this submission, and the hash of its token if it has one
///     request    v1::WorkerRequest as text; if it differs from the current request, the folder is
///                made anew
///     mesh
///     begun.R    a run R has begun        events.R   what it reported
///     log.R      its standard error       model.R    its result
///     end        "R STATUS": the first run to end; the others' links fail
///
/// One thread.
class SlurmTask {
 public:
  /// Makes the folder, or takes up one with the same request that an earlier daemon left.
  /// Errors: those of write_input, FailedPrecondition (DATABASE_UNUSABLE).
  static absl::StatusOr<SlurmTask> Prepare(DecompositionTask task,
                                           const SlurmExecutorOptions& options, RemoteRuns& runs);

  const DecompositionTask& task() const { return task_; }
  const SlurmJob& job() const { return job_; }

  /// The job to submit now, with a ticket of its own. Where its run is to upload, it has a token of
  /// its own, too, and that of any earlier submission is worth nothing. Errors: FailedPrecondition
  /// (DATABASE_UNUSABLE).
  absl::StatusOr<SlurmJob> NextSubmission();

  /// Tells progress that runs have reported since the last call.
  void ReadProgress();

  /// The outcome, once a run has ended.
  std::optional<Outcome> TakeEnd() const;

  /// The outcome of a job that left the queue without an end, if there is no hope in another run.
  std::optional<Outcome> JudgeLoss(std::optional<SlurmState> state) const;

  /// Lets its runs bring nothing more, and removes the folder.
  void Remove() const;

  /// Lets runs in whose jobs an earlier daemon left in `directory`, before any task is prepared.
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
