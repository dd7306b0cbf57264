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

/// How nodes that share no folder with the daemon reach it.
struct SlurmUpload {
  std::string address{};  ///< of the daemon, as the nodes see it; empty: a folder is shared
  std::filesystem::path client{};  ///< the program `carillon`, on every node
  std::string tls_roots_file{};    ///< PEM, on every node; empty: without TLS
};

struct SlurmExecutorOptions {
  std::filesystem::path program{};  ///< carillon-precompute, on every node
  std::filesystem::path
      directory{};  ///< seen under this name by every node, too, unless they upload
  SlurmUpload upload{};
  std::string partition{};  ///< empty: the cluster's default
  int job_count = 200;      ///< in the cluster's queue at a time
  int threads_per_job = 1;
  uint64_t memory_limit_bytes = 64ULL << 30;  ///< of one job
  std::chrono::seconds time_limit = std::chrono::hours(6);
  std::chrono::milliseconds poll_interval = std::chrono::seconds(2);
};

/// Runs each decomposition as a job of a Slurm cluster, with files in a shared folder; or with
/// `upload`, where each submission has a token, with which its run fetches the mesh and brings the
/// result through `runs`, which must outlive the executor.
///
/// The caller's database owns the intent, and Slurm may forget: a controller that is killed loses
/// what it acknowledged in its last seconds and gives the numbers out again. So a job's name is the
/// digest, its number is never trusted, and it has ended when, and only when, it has put its result
/// into the folder: the first run to do so counts, whatever runs beside it. A job that neither is
/// in the queue nor has ended is submitted again. Jobs outlive the executor, and the next one
/// adopts them. Errors: FailedPrecondition (DATABASE_UNUSABLE: the directory cannot be made).
absl::StatusOr<std::unique_ptr<Executor>> MakeSlurmExecutor(const SlurmExecutorOptions& options,
                                                            RemoteRuns& runs);

}  // namespace carillon
