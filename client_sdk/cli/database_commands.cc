// SPDX-License-Identifier: Apache-2.0
//
// The commands that look after stored models.
#include <algorithm>
#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/find_model.h"
#include "client_sdk/cli/output.h"

namespace carillon::cli {
namespace {

constexpr double kMib = 1 << 20;

bool IsDigest(const std::string& text) {
  return text.size() == 64 && std::ranges::all_of(text, [](unsigned char c) {
           return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

}  // namespace

absl::Status UpdateModel(const client::Client& daemon, const std::string& text,
                         v1::UpdateModalModelRequest change, bool json) {
  const auto name = FindModel(daemon, text);
  if (!name.ok()) return name.status();
  change.set_name(*name);
  const auto model = daemon.UpdateModalModel(change);
  if (!model.ok()) return model.status();
  if (json) PrintJson(*model);
  return absl::OkStatus();
}

absl::Status ExportModel(const client::Client& daemon, const std::string& text, std::string file) {
  const auto name = FindModel(daemon, text);
  if (!name.ok()) return name.status();
  if (file.empty()) file = absl::StrCat(absl::StripPrefix(*name, "modalModels/"), ".model");
  absl::Status status = daemon.ExportModalModel(*name, file);
  if (status.ok()) absl::PrintF("%s\n", file);
  return status;
}

absl::Status ImportModel(const client::Client& daemon, const std::string& file,
                         const std::string& label, bool json) {
  const std::string stem = std::filesystem::path(file).stem();
  const std::string name = IsDigest(stem) ? absl::StrCat("modalModels/", stem) : "";
  const auto model = daemon.ImportModalModel(file, name, label);
  if (!model.ok()) return model.status();
  if (json) {
    PrintJson(*model);
  } else {
    absl::PrintF("%s\n", model->name());
  }
  return absl::OkStatus();
}

absl::Status ShowDatabaseStats(const client::Client& daemon, bool json) {
  const auto stats = daemon.GetDatabaseStats();
  if (!stats.ok()) return stats.status();
  if (json) {
    PrintJson(*stats);
    return absl::OkStatus();
  }
  absl::PrintF("models       %d, %.1f MiB\n", stats->model_count(),
               static_cast<double>(stats->model_bytes()) / kMib);
  absl::PrintF("quarantined  %d\n", stats->quarantined_count());
  absl::PrintF("meshes       %d, %.1f MiB\n", stats->mesh_count(),
               static_cast<double>(stats->mesh_bytes()) / kMib);
  absl::PrintF("jobs         %d, %d unfinished\n", stats->job_count(),
               stats->unfinished_job_count());
  absl::PrintF("file         %.1f MiB, %.1f MiB free, schema %d\n",
               static_cast<double>(stats->file_bytes()) / kMib,
               static_cast<double>(stats->free_bytes()) / kMib, stats->schema_version());
  return absl::OkStatus();
}

absl::Status CollectGarbage(const client::Client& daemon, uint64_t budget_mib, bool json) {
  const auto collected = daemon.CollectGarbage(budget_mib << 20U);
  if (!collected.ok()) return collected.status();
  if (json) {
    PrintJson(*collected);
  } else {
    absl::PrintF("%d models deleted, %.1f MiB\n", collected->deleted_count(),
                 static_cast<double>(collected->deleted_bytes()) / kMib);
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
