// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>

#include "absl/status/status.h"

namespace carillon::cli {

/// Lets the program of a daemon on this machine check its command line, its configuration file and
/// the files that they name, as it would at a start (`carillond --check-config`). Returns the error
/// with which the daemon would refuse to start again, or OK. Returns nothing if the process is no
/// carillond of this user, or if the check does not end.
std::optional<absl::Status> CheckSettingsOf(pid_t process);

}  // namespace carillon::cli
