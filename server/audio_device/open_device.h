// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"

namespace carillon {

/// A device, and why it is not the one wanted.
struct OpenedDevice {
  std::unique_ptr<AudioDevice> device;
  /// One line; empty where the device is what was asked for.
  std::string message;
};

/// Opens what `specification` names: "portaudio" or "portaudio:PART OF A NAME", "null" (nothing
/// sounds, time passes), "file:PATH" (the mix as a WAV file, in real time), or "auto": a sound card
/// where there is one, else null with the reason in `message`.
/// Errors: InvalidArgument (INVALID_AUDIO_DEVICE), and those of the device.
absl::StatusOr<OpenedDevice> OpenDevice(absl::string_view specification, const DeviceFormat& format,
                                        Clock& clock);

}  // namespace carillon
