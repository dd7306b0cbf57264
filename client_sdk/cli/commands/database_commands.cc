// SPDX-License-Identifier: Apache-2.0
//
// The commands that look after stored models.
#include <filesystem>
#include <system_error>

#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr double kMib = 1 << 20;

}  // namespace

absl::Status UpdateModel(const client::Client& daemon, const std::string& text,
                         v1::UpdateModalModelRequest change, bool json) {
  ASSIGN_OR_RETURN(const auto name, FindModel(daemon, text));
  change.set_name(name);
  ASSIGN_OR_RETURN(const auto model, daemon.UpdateModalModel(change));
  if (json) PrintJson(model);
  return absl::OkStatus();
}

absl::Status ShowDatabaseStats(const client::Client& daemon, bool json) {
  ASSIGN_OR_RETURN(const auto stats, daemon.GetDatabaseStats());
  if (json) {
    PrintJson(stats);
    return absl::OkStatus();
  }
  absl::PrintF("models       %d, %.1f MiB\n", stats.model_count(),
               static_cast<double>(stats.model_bytes()) / kMib);
  absl::PrintF("quarantined  %d\n", stats.quarantined_count());
  absl::PrintF("meshes       %d, %.1f MiB\n", stats.mesh_count(),
               static_cast<double>(stats.mesh_bytes()) / kMib);
  absl::PrintF("jobs         %d, %d unfinished\n", stats.job_count(), stats.unfinished_job_count());
  absl::PrintF("file         %.1f MiB, %.1f MiB free, schema %d\n",
               static_cast<double>(stats.file_bytes()) / kMib,
               static_cast<double>(stats.free_bytes()) / kMib, stats.schema_version());
  return absl::OkStatus();
}

absl::Status BackUpDatabase(const client::Client& daemon, const std::string& file, bool json) {
  RETURN_IF_ERROR(daemon.BackUpDatabase(file));
  std::error_code error;
  const uint64_t byte_count = std::filesystem::file_size(file, error);
  // A device or a pipe has no size.
  if (json) PrintJson({{"file", file}, {"byte_count", error ? uint64_t{0} : byte_count}});
  return absl::OkStatus();
}

absl::Status CollectGarbage(const client::Client& daemon, const v1::CollectGarbageRequest& request,
                            bool json) {
  ASSIGN_OR_RETURN(const auto collected, daemon.CollectGarbage(request));
  if (json) {
    PrintJson(collected);
  } else {
    absl::PrintF("%s %sdeleted, %.1f MiB; %s without a model or job, %.1f MiB\n",
                 Counted(collected.deleted_count(), "model"), request.dry_run() ? "would be " : "",
                 static_cast<double>(collected.deleted_bytes()) / kMib,
                 Counted(collected.deleted_mesh_count(), "mesh"),
                 static_cast<double>(collected.deleted_mesh_bytes()) / kMib);
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
