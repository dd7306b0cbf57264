// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"

namespace carillon {

/// The wanted device.
struct DeviceSettings {
  /// "portaudio" or "portaudio:PART OF A NAME" (a sound card), "null" (silent, in real time),
  /// "file:PATH" (a WAV file, in real time), or "auto" (the default sound card).
  std::string specification = "auto";
  DeviceFormat format{};
  /// Path of carillon-audio, which opens sound cards.
  std::string program{};
};

/// Checks DeviceSettings::specification without opening a device. Errors: InvalidArgument
/// (INVALID_CONFIGURATION: it names no kind of device, or a file that holds something else than a
/// sound).
absl::Status CheckDevice(absl::string_view specification);

/// Opens a device. Errors: those of CheckDevice, OpenDeviceProcess and WavWriter::Make.
absl::StatusOr<std::unique_ptr<AudioDevice>> OpenDevice(const DeviceSettings& settings,
                                                        Clock& clock);

/// Opens the null device.
std::unique_ptr<AudioDevice> OpenNullDevice(const DeviceFormat& format, Clock& clock);

}  // namespace carillon
