// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/worker_command.h"

#include <fstream>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/worker_request_text.h"
#include "server/decomposition/worker/work_folder.h"

namespace carillon {

std::string WorkerRequestFile(const DecompositionTask& task) {
  const v1::CreateModalModelRequest& resolved = task.request;
  worker::v1::WorkerRequest request;
  if (task.radiates) {
    request.set_radiate_stored_model(true);
    *request.mutable_transfer() = resolved.transfer();
  } else {
    request.set_mesh_format(resolved.mesh_format());
    *request.mutable_settings() = resolved.settings();
    request.set_cautious(task.way >= 1);
    if (task.way >= 2) request.mutable_settings()->mutable_mesh()->set_repair(true);
  }
  *request.mutable_material() = resolved.material();
  request.set_size(resolved.size());
  request.set_min_frequency_hz(resolved.min_frequency_hz());
  request.set_max_frequency_hz(resolved.max_frequency_hz());
  return WorkerRequestText(request);
}

absl::Status WriteWorkerRequest(const DecompositionTask& task, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  out << WorkerRequestFile(task);
  out.close();
  if (!out.fail()) return absl::OkStatus();
  return UnusableWorkFolder(file, std::make_error_code(std::errc::no_space_on_device));
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
