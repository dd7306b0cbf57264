// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/open_device.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "server/audio_device/clocked_device.h"
#include "server/audio_device/portaudio_device.h"
#include "server/audio_device/wav_writer.h"

namespace carillon {
namespace {

std::unique_ptr<AudioDevice> OpenNullDevice(const DeviceFormat& format, Clock& clock) {
  return std::make_unique<ClockedDevice>("null", format, clock, nullptr);
}

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenFileDevice(absl::string_view path,
                                                            const DeviceFormat& format,
                                                            Clock& clock) {
  absl::StatusOr<WavWriter> made =
      WavWriter::Make(std::string(path), format.sample_rate_hz, format.channel_count);
  if (!made.ok()) return made.status();
  auto writer = std::make_shared<WavWriter>(*std::move(made));
  return std::make_unique<ClockedDevice>(
      absl::StrCat("file: ", path), format, clock,
      [writer](std::span<const float> block) { return writer->Write(block).ok(); });
}

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenNamed(absl::string_view specification,
                                                       const DeviceFormat& format, Clock& clock) {
  absl::string_view rest = specification;
  if (specification == "null") return OpenNullDevice(format, clock);
  if (specification == "portaudio") return OpenPortAudioDevice("", format);
  if (absl::ConsumePrefix(&rest, "portaudio:")) return OpenPortAudioDevice(rest, format);
  if (absl::ConsumePrefix(&rest, "file:") && !rest.empty()) {
    return OpenFileDevice(rest, format, clock);
  }
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_AUDIO_DEVICE",
                 absl::StrCat("\"", specification,
                              "\" names no audio device; say auto, portaudio, portaudio:NAME, null "
                              "or file:PATH"));
}

}  // namespace

absl::StatusOr<OpenedDevice> OpenDevice(absl::string_view specification, const DeviceFormat& format,
                                        Clock& clock) {
  const bool automatic = specification == "auto";
  absl::StatusOr<std::unique_ptr<AudioDevice>> device =
      OpenNamed(automatic ? "portaudio" : specification, format, clock);
  if (device.ok()) return OpenedDevice{.device = *std::move(device), .message = ""};
  if (!automatic) return device.status();
  return OpenedDevice{.device = OpenNullDevice(format, clock),
                      .message = ToErrorInfo(device.status()).message()};
}

}  // namespace carillon
