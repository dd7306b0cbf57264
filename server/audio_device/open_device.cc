// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/open_device.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/clocked_device.h"
#include "server/audio_device/device_process.h"
#include "server/audio_device/wav_writer.h"

namespace carillon {
namespace {

/// Whether a file exists that holds something other than a sound.
bool HoldsOther(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream file(path, std::ios::binary);
  std::string begin(4, '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return file.gcount() > 0 && begin != "RIFF" && begin != "RF64";
}

/// Checks that this user may write to a file, or make it.
absl::Status CheckMayWrite(const std::string& path) {
  std::error_code ignored;
  const bool exists = std::filesystem::exists(path, ignored);
  const std::string changed =
      exists ? path : std::filesystem::absolute(path, ignored).parent_path().string();
  int error = std::filesystem::is_directory(path, ignored) ? EISDIR : 0;
  if (error == 0 && faccessat(AT_FDCWD, changed.c_str(), W_OK, AT_EACCESS) != 0) error = errno;
  if (error == 0) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "OUTPUT_NOT_WRITABLE",
      absl::StrCat("cannot write \"", path, "\": ", std::generic_category().message(error),
                   "; name a file in a folder that exists and may be written"));
}

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenFileDevice(absl::string_view path,
                                                            const DeviceFormat& format,
                                                            Clock& clock) {
  ASSIGN_OR_RETURN(WavWriter made,
                   WavWriter::Make(std::string(path), format.sample_rate_hz, format.channel_count));
  auto writer = std::make_shared<WavWriter>(std::move(made));
  return std::make_unique<ClockedDevice>(
      absl::StrCat("file: ", path), format, clock,
      [writer](std::span<const float> block) { return writer->Write(block); });
}

}  // namespace

std::unique_ptr<AudioDevice> OpenNullDevice(const DeviceFormat& format, Clock& clock) {
  return std::make_unique<ClockedDevice>("null", format, clock, nullptr);
}

absl::Status CheckDevice(absl::string_view specification) {
  absl::string_view rest = specification;
  if (specification == "null" || specification == "auto" || specification == "portaudio" ||
      absl::StartsWith(specification, "portaudio:")) {
    return absl::OkStatus();
  }
  if (!absl::ConsumePrefix(&rest, "file:") || rest.empty()) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION",
        absl::StrCat("\"", specification,
                     "\" names no audio device; say auto, portaudio, portaudio:NAME, null "
                     "or file:PATH"));
  }
  if (!HoldsOther(std::string(rest))) return CheckMayWrite(std::string(rest));
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_CONFIGURATION",
                 absl::StrCat("\"", rest,
                              "\" holds something other than a WAV sound, and stays as it is: "
                              "name another file with --audio-device file:PATH"));
}

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenDevice(const DeviceSettings& settings,
                                                        Clock& clock) {
  RETURN_IF_ERROR(CheckDevice(settings.specification));
  absl::string_view rest = settings.specification;
  if (rest == "null") return OpenNullDevice(settings.format, clock);
  if (absl::ConsumePrefix(&rest, "file:")) return OpenFileDevice(rest, settings.format, clock);
  if (!absl::ConsumePrefix(&rest, "portaudio:")) rest = "";
  return OpenDeviceProcess(settings.program, rest, settings.format, clock);
}

}  // namespace carillon
