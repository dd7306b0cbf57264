// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"

namespace carillon {

/// A device, and if it replaces the one asked for, the reason.
struct OpenedDevice {
  std::unique_ptr<AudioDevice> device;
  /// One line; empty if the device is the one that was asked for.
  std::string message;
};

/// Opens the device that `specification` names: "portaudio" or "portaudio:PART OF A NAME", "null"
/// (silent, in real time), "file:PATH" (a WAV file, in real time), or "auto": a sound card if there
/// is one, else null with the reason in `message`. Errors: InvalidArgument (INVALID_AUDIO_DEVICE),
/// and those of the device.
absl::StatusOr<OpenedDevice> OpenDevice(absl::string_view specification, const DeviceFormat& format,
                                        Clock& clock);

}  // namespace carillon
