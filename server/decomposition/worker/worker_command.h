// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/worker/v1/worker.pb.h"
#include "server/decomposition/job/executor.h"

namespace carillon {

/// The files that one decomposition reads and writes, and the number of its threads.
struct WorkerPlace {
  std::filesystem::path program;
  std::filesystem::path mesh_file;
  std::filesystem::path request_file;
  std::filesystem::path model_file;
  int thread_count = 1;
};

/// Number of ways to compute one request: 0 as asked, 1 with more cautious meshing, 2 with the
/// surface repaired, too.
constexpr uint32_t kWayCount = 3;

/// Returns the request to carillon-precompute for a task and its way (below kWayCount), as a
/// worker::v1::WorkerRequest in protobuf's text form.
std::string WorkerRequestFile(const DecompositionTask& task);

/// Writes WorkerRequestFile to `file`. Errors: FailedPrecondition (WORK_FOLDER_UNUSABLE).
absl::Status WriteWorkerRequest(const DecompositionTask& task, const std::filesystem::path& file);

/// Returns the command line of carillon-precompute, which writes its events to descriptor 3.
std::vector<std::string> WorkerCommand(const WorkerPlace& place);

}  // namespace carillon
