// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/open_device.h"

#include <utility>

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

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenDevice(const DeviceSettings& settings,
                                                        Clock& clock) {
  const absl::string_view specification = settings.specification;
  absl::string_view rest = specification;
  if (specification == "null") return OpenNullDevice(settings.format, clock);
  if (specification == "auto" || specification == "portaudio") {
    return OpenDeviceProcess(settings.program, "", settings.format, clock);
  }
  if (absl::ConsumePrefix(&rest, "portaudio:")) {
    return OpenDeviceProcess(settings.program, rest, settings.format, clock);
  }
  if (absl::ConsumePrefix(&rest, "file:") && !rest.empty()) {
    return OpenFileDevice(rest, settings.format, clock);
  }
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_AUDIO_DEVICE",
                 absl::StrCat("\"", specification,
                              "\" names no audio device; say auto, portaudio, portaudio:NAME, null "
                              "or file:PATH"));
}

}  // namespace carillon
