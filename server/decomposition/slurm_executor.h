// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/decomposition/executor.h"

namespace carillon {

class RemoteRuns;

/// Access to the daemon for nodes that share no folder with it.
struct SlurmUpload {
  std::string address{};  ///< HOST:PORT of the daemon for the nodes; empty if a folder is shared
  std::filesystem::path client{};  ///< path of `carillon` on every node
  std::string tls_roots_file{};    ///< PEM, on every node; without TLS if empty
};

struct SlurmExecutorOptions {
  std::filesystem::path program{};  ///< carillon-precompute, on every node
  std::filesystem::path
      directory{};  ///< mounted at the same path on every node, unless they upload
  SlurmUpload upload{};
  std::string partition{};  ///< if empty, the cluster's default
  int job_count = 200;      ///< jobs in the cluster's queue at a time
  int threads_per_job = 1;
  uint64_t memory_limit_bytes = 64ULL << 30;  ///< memory of one job
  std::chrono::seconds time_limit = std::chrono::hours(6);
  std::chrono::milliseconds poll_interval = std::chrono::seconds(2);
};

/// Runs each decomposition as a job of a Slurm cluster, with files in a shared folder. With
/// `upload` no folder is shared. Each submission then has a token, with which its run fetches the
/// mesh and uploads the result through `runs`. `runs` must outlive the executor.
///
/// Slurm may forget jobs. A controller that is killed loses the submissions that it acknowledged in
/// its last seconds, and assigns their numbers again. Therefore a job is named by its digest and
/// not by its number, and it has ended if, and only if, its result is in the folder. The first run
/// that puts a result there counts. A job that has not ended and is not in Slurm's queue is
/// submitted again. Jobs outlive the executor, and the next executor adopts them. Errors:
/// FailedPrecondition (DATABASE_UNUSABLE: the directory cannot be made).
absl::StatusOr<std::unique_ptr<Executor>> MakeSlurmExecutor(const SlurmExecutorOptions& options,
                                                            RemoteRuns& runs);

}  // namespace carillon
