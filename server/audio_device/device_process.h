// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"

namespace carillon {

/// Opens a sound card in a process of its own: `program` (carillon-audio), which calls PortAudio. A
/// call of PortAudio can wait for ever once its sound server has died. The process is then killed
/// after a bounded time. Each process lists the devices anew, whereas PortAudio lists them only
/// when it is initialized.
///
/// `name` is a part of the wanted device's name in upper or lower case ("jack", "pulse"). If `name`
/// is empty, the system's default is opened. Errors: NotFound (AUDIO_DEVICE_NOT_FOUND: the message
/// lists the devices there are), Unavailable (AUDIO_DEVICE_FAILED), and those of
/// ChildProcess::Start.
absl::StatusOr<std::unique_ptr<AudioDevice>> OpenDeviceProcess(const std::string& program,
                                                               absl::string_view name,
                                                               const DeviceFormat& format,
                                                               Clock& clock);

}  // namespace carillon
