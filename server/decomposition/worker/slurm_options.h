// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

namespace carillon {

struct SlurmExecutorOptions {
  std::filesystem::path program{};    ///< carillon-precompute, on every node
  std::filesystem::path directory{};  ///< mounted at the same path on every node
  int job_count = 200;                ///< jobs in the cluster's queue at a time
  int threads_per_job = 1;
  uint64_t memory_limit_bytes = 64ULL << 30;  ///< memory of one job
  std::chrono::seconds time_limit = std::chrono::hours(6);
  std::chrono::milliseconds poll_interval = std::chrono::seconds(2);
};

}  // namespace carillon
