// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/worker/oom_kills.h"

namespace carillon {

struct LocalExecutorOptions {
  std::filesystem::path program{};  ///< carillon-precompute
  /// The folder for the files of running tasks; MakeLocalExecutor empties it.
  std::filesystem::path directory{};
  int worker_count = 0;  ///< 0 means half of the processors, at least 1
  int threads_per_worker = 1;
  uint64_t memory_budget_bytes = 0;  ///< resident memory of all workers; 0 means half of RAM
  uint64_t memory_limit_bytes = 0;   ///< resident memory of one worker; 0 means the whole budget
  std::chrono::milliseconds time_limit = std::chrono::hours(6);
  /// Longest time without an event, while a worker computes or sleeps; see WorkerLimits.
  std::chrono::milliseconds stall_limit = std::chrono::seconds(60);
  std::filesystem::path kernel_counts = kKernelCounts;  ///< see OomKillCount
};

/// Checks the options without making anything. Errors: FailedPrecondition (WORKER_NOT_FOUND:
/// `program` cannot be executed).
absl::Status CheckLocalExecutor(const LocalExecutorOptions& options);

/// Runs each decomposition in a child process (child_process.h), with limits of memory and time.
/// One thread starts and watches all workers, because the kernel sends the parent-death signal when
/// the starting *thread* ends. A second thread makes the calls that wait for the disk, so that they
/// delay neither progress nor a cancellation. Errors: those of CheckLocalExecutor,
/// FailedPrecondition (WORK_FOLDER_UNUSABLE: the directory cannot be made). `clock` must outlive
/// the executor.
absl::StatusOr<std::unique_ptr<Executor>> MakeLocalExecutor(const LocalExecutorOptions& options,
                                                            const Clock& clock);

}  // namespace carillon
