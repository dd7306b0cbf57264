// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "absl/status/statusor.h"

namespace carillon::cli {

/// Returns the process that listens at a Unix socket; the number is zero if the process belongs to
/// another PID namespace. Errors: Unavailable (SERVER_UNAVAILABLE: no process listens there, or
/// this user may not connect).
absl::StatusOr<pid_t> ProcessAt(const std::string& socket_path);

/// Lets the program of a daemon on this machine check its command line, its configuration file and
/// the files that they name, as it would at a start (`carillond --check-config`). Returns the error
/// with which the daemon would refuse to start again, or OK. Returns nothing if the process is no
/// carillond of this user, or if the check does not end.
std::optional<absl::Status> CheckSettingsOf(pid_t process);

}  // namespace carillon::cli
