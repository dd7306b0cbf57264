// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "server/decomposition/executor.h"
#include "server/decomposition/slurm_executor.h"
#include "server/decomposition/slurm_queue.h"

namespace carillon {

/// One decomposition in a folder that the cluster shares:
///
///     ticket     what this submission is known by; made anew where the request is another
///     mesh       job.sh
///     begun.R    a run R has begun        events.R   what it reported
///     log.R      its standard error       model.R    its result
///     end        "R STATUS": the first run to end; the others' links fail
///
/// One thread.
class SlurmTask {
 public:
  /// Makes the folder, or takes up one with the same request that an earlier daemon left.
  /// Errors: those of write_mesh, FailedPrecondition (DATABASE_UNUSABLE).
  static absl::StatusOr<SlurmTask> Prepare(DecompositionTask task,
                                           const SlurmExecutorOptions& options);

  const DecompositionTask& task() const { return task_; }
  const SlurmJob& job() const { return job_; }

  /// Whether it was there before: its job may be in the queue, or have ended.
  bool taken_up() const { return taken_up_; }

  /// Tells progress that runs have reported since the last call.
  void ReadProgress();

  /// The outcome, once a run has ended.
  std::optional<Outcome> TakeEnd() const;

  /// The outcome of a job that left the queue without an end, if there is no hope in another run.
  std::optional<Outcome> JudgeLoss(std::optional<SlurmState> state) const;

  /// Removes the folder.
  void Remove() const;

 private:
  SlurmTask(DecompositionTask task, std::filesystem::path folder)
      : task_(std::move(task)), folder_(std::move(folder)) {}

  absl::Status MakeFolder(const std::string& request, const SlurmExecutorOptions& options);
  int RunCount() const;

  DecompositionTask task_;
  std::filesystem::path folder_;
  SlurmJob job_;
  bool taken_up_ = false;
  std::string progress_bytes_;  // of the last that was told
  double fraction_ = 0;
};

}  // namespace carillon
