// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

#include "absl/status/status.h"

namespace carillon {

/// Gives `thread` real-time priority (SCHED_FIFO), below that of a sound server. Errors:
/// PermissionDenied (REALTIME_NOT_ALLOWED: the message names the setting that allows it).
absl::Status MakeRealtime(std::thread& thread);

}  // namespace carillon
