// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/worker/slurm_options.h"

namespace carillon {

/// Runs each decomposition as a job of a Slurm cluster, with files in a shared folder.
///
/// Slurm may forget jobs. A controller that is killed loses the submissions that it acknowledged in
/// its last seconds, and assigns their numbers again. Therefore a job is named by its digest and
/// not by its number, and it has ended if, and only if, its result is in the folder. The first run
/// that puts a result there counts. A job that has not ended and is not in Slurm's queue is
/// submitted again. Jobs outlive the executor, and the next executor adopts them. Errors:
/// FailedPrecondition (DATABASE_UNUSABLE: the directory cannot be made).
absl::StatusOr<std::unique_ptr<Executor>> MakeSlurmExecutor(const SlurmExecutorOptions& options);

}  // namespace carillon
