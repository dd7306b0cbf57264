// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/room_settings.h"

#include <chrono>
#include <cstdint>
#include <string>

#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/open_device.h"

namespace carillon {
namespace {

std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000));
}

/// Returns the setting that is at fault when the API refuses its settings for a reason.
std::string ApiSetting(const std::string& reason) {
  if (reason == "ACCESS_FILE_UNUSABLE") return "access_file";
  if (reason == "HEAD_UNUSABLE") return "head";
  return reason == "TLS_UNUSABLE" ? "tls_certificate" : "listen";
}

/// Returns the same refusal of a setting with its place in the configuration file.
absl::Status At(const SettingPlaces& places, const std::string& setting,
                const absl::Status& status) {
  const auto place = places.find(setting);
  return status.ok() || place == places.end() ? status : AtPlace(status, place->second);
}

}  // namespace

LocalExecutorOptions LocalExecutorOptionsOf(const Options& options) {
  LocalExecutorOptions local;
  local.program = options.precompute_program;
  local.directory = DataDirectory::WorkDirectory(options.data_directory);
  local.worker_count = options.worker_count;
  local.memory_budget_bytes = static_cast<uint64_t>(options.memory_budget_mib) << 20U;
  local.memory_limit_bytes = static_cast<uint64_t>(options.job_memory_mib) << 20U;
  local.time_limit = Milliseconds(options.job_time_s);
  return local;
}

OutputSettings OutputSettingsOf(const Options& options) {
  return {.format = {.sample_rate_hz = options.sample_rate_hz,
                     .block_frame_count = options.block_frame_count,
                     .channel_count = options.channel_count},
          .look_ahead_block_count = options.look_ahead_block_count,
          .device = options.audio_device,
          .device_program = ProgramBeside("carillon-audio"),
          .full_scale_pa = options.full_scale_pa};
}

ApiSettings ApiSettingsOf(const Options& options) {
  return {.addresses = options.addresses,
          .tls = {.certificate = options.tls_certificate_file,
                  .key = options.tls_key_file,
                  .client_roots = options.tls_client_roots_file},
          .access_file = options.access_file,
          .head_file = options.head_file,
          .version = CARILLON_VERSION,
          .scene_grace_s = options.scene_grace_s,
          .client_share = options.client_share,
          .slurm = options.uses_slurm()};
}

absl::Status CheckRooms(const CommandLine& command) {
  const Options& options = command.options;
  const auto at = [&](const std::string& setting, const absl::Status& status) {
    return At(command.places, setting, status);
  };
  RETURN_IF_ERROR(at("data_dir", DataDirectory::Check(options.data_directory)));
  if (!options.uses_slurm()) {
    RETURN_IF_ERROR(at("precompute", CheckLocalExecutor(LocalExecutorOptionsOf(options))));
  }
  RETURN_IF_ERROR(at("audio_device", CheckDevice(options.audio_device)));
  const absl::Status api = ApiServer::Check(ApiSettingsOf(options), options.sample_rate_hz);
  return at(ApiSetting(ToErrorInfo(api).reason()), api);
}

}  // namespace carillon
