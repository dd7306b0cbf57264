// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "server/base/event.h"

namespace carillon {

/// Sends the log to stderr, one line a message; stdout is left to output that programs read. If
/// stderr is systemd's journal, sends each message to the journal with its level and its fields.
void SetUpLog();

/// Sets the lowest level that is logged, by its name in Options::log_level.
void SetLogLevel(const std::string& name);

/// Sets the lowest level that is logged to `name`, unless the present one is lower still.
void LowerLogLevel(const std::string& name);

void LogEvent(const Event& event);

}  // namespace carillon
