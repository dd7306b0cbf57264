// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

#include "absl/status/status.h"

namespace carillon {

/// The threads of the sound's way, the most urgent last.
enum class Urgency { kDelivery = 8, kRendering = 9 };

/// Gives `thread` real-time priority (SCHED_FIFO), below that of a sound server. Errors:
/// PermissionDenied (REALTIME_NOT_ALLOWED: the message names the setting that allows it).
absl::Status MakeRealtime(std::thread& thread, Urgency urgency);

}  // namespace carillon
