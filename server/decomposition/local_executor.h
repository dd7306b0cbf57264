// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/decomposition/executor.h"

namespace carillon {

struct LocalExecutorOptions {
  std::filesystem::path program{};    ///< carillon-precompute
  std::filesystem::path directory{};  ///< for the files of running tasks; emptied at the start
  int worker_count = 0;               ///< 0: half of the processors, at least 1
  int threads_per_worker = 1;
  uint64_t memory_budget_bytes = 0;  ///< resident, all workers; 0: half of the machine's
  uint64_t memory_limit_bytes = 0;   ///< resident, a worker; 0: the whole budget
  std::chrono::milliseconds time_limit = std::chrono::hours(6);
  std::chrono::milliseconds stall_limit = std::chrono::seconds(60);  ///< without any event
};

/// Runs each decomposition in a child process of its own group, niced, on no more processors than
/// workers and threads are wanted, limited in memory and time, killed as a group, and killed by the
/// kernel when this process dies. One thread spawns and watches all of them (the kernel's
/// parent-death signal follows the spawning *thread*); another does what waits for the disk, so
/// that a cancel need not. Errors: FailedPrecondition (WORKER_NOT_FOUND: `program` cannot be
/// executed; DATABASE_UNUSABLE: the directory cannot be made). `clock` must outlive the executor.
absl::StatusOr<std::unique_ptr<Executor>> MakeLocalExecutor(const LocalExecutorOptions& options,
                                                            const Clock& clock);

}  // namespace carillon
