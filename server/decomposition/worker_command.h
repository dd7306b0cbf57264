// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "server/decomposition/executor.h"

namespace carillon {

/// Where one decomposition reads and writes, and how many threads it may use.
struct WorkerPlace {
  std::filesystem::path program;
  std::filesystem::path mesh_file;
  std::filesystem::path request_file;
  std::filesystem::path model_file;
  int thread_count = 1;
};

/// The ways there are to compute one request: as asked; meshing with more caution; with the surface
/// repaired, too.
constexpr uint32_t kWayCount = 3;

/// The request to carillon-precompute for a task, computed in the task's way (below kWayCount): a
/// v1::WorkerRequest in protobuf's text form.
std::string WorkerRequestFile(const DecompositionTask& task);

/// Writes WorkerRequestFile to `file`. Errors: FailedPrecondition (DATABASE_UNUSABLE).
absl::Status WriteWorkerRequest(const DecompositionTask& task, const std::filesystem::path& file);

/// The command line of carillon-precompute, which reports to descriptor 3.
std::vector<std::string> WorkerCommand(const WorkerPlace& place);

}  // namespace carillon
