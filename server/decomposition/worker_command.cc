// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker_command.h"

#include <fstream>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/worker_request_text.h"

namespace carillon {

std::string WorkerRequestFile(const v1::CreateModalModelRequest& resolved, uint32_t way) {
  v1::WorkerRequest request;
  request.set_mesh_format(resolved.mesh_format());
  *request.mutable_settings() = resolved.settings();
  *request.mutable_material() = resolved.material();
  request.set_size(resolved.size());
  request.set_min_frequency_hz(resolved.min_frequency_hz());
  request.set_max_frequency_hz(resolved.max_frequency_hz());
  request.set_cautious(way >= 1);
  if (way >= 2) request.mutable_settings()->mutable_mesh()->set_repair(true);
  return WorkerRequestText(request);
}

absl::Status WriteWorkerRequest(const v1::CreateModalModelRequest& resolved, uint32_t way,
                                const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << WorkerRequestFile(resolved, way);
  out.close();
  if (!out.fail()) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat(file.string(), " cannot be written: see that its folder has room"));
}

std::vector<std::string> WorkerCommand(const WorkerPlace& place) {
  return {place.program.string(),
          place.mesh_file.string(),
          absl::StrCat("--out=", place.model_file.string()),
          absl::StrCat("--request=", place.request_file.string()),
          absl::StrCat("--threads=", place.thread_count),
          "--events-fd=3"};
}

}  // namespace carillon
