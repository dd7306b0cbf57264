// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/audio_device/audio_device.h"

namespace carillon {

/// Opens a sound card through PortAudio (ALSA, JACK, PulseAudio's ALSA plug-in).
///
/// `name` is a part of the wanted device's name in upper or lower case ("jack", "pulse"). If `name`
/// is empty, the system's default is opened. Each pull has exactly `format.block_frame_count`
/// frames. Errors: NotFound (AUDIO_DEVICE_NOT_FOUND: the message lists the devices there are),
/// Unavailable (AUDIO_DEVICE_FAILED). Sound libraries print about a hundred lines on stderr while
/// they search for devices. Check is called every 20 ms.
absl::StatusOr<std::unique_ptr<AudioDevice>> OpenPortAudioDevice(absl::string_view name,
                                                                 const DeviceFormat& format);

}  // namespace carillon
