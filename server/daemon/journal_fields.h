// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "server/base/event.h"

namespace carillon {

/// Returns whether systemd's journal reads the file `descriptor`, as $JOURNAL_STREAM says
/// (systemd.exec(5)). A variable that was inherited from a service may name another file.
bool IsJournal(int descriptor);

/// Returns the fields of a line for the journal, such as "PRIORITY=6" (systemd.journal-fields(7)).
std::vector<std::string> JournalFields(LogLevel level, const std::string& line);

/// Returns the fields of an event: those of its line, CARILLON_EVENT with its name, and
/// CARILLON_KEY for each of its fields.
std::vector<std::string> JournalFields(const Event& event);

}  // namespace carillon
