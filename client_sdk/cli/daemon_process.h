// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon::cli {

/// Returns the process that listens at a Unix socket. Errors: Unavailable (SERVER_UNAVAILABLE), if
/// no process listens there or this user may not connect.
absl::StatusOr<pid_t> ProcessAt(const std::string& socket_path);

/// Returns a process as "carillond (process 123)", as far as this user can see it.
std::string ProcessName(pid_t process);

/// Returns the name of the program that the process executes, "carillond" for instance, or nothing
/// if this user cannot see it.
std::string ProgramOf(pid_t process);

/// Returns the words of the process's command line, of which the first one names the program. They
/// are none if this user cannot see them.
std::vector<std::string> ArgumentsOf(pid_t process);

/// Returns the variables that the process was started with, as NAME=VALUE. They are none if this
/// user cannot see them.
std::vector<std::string> EnvironmentOf(pid_t process);

/// Returns whether the real, effective, saved and file-system users of a process are all this user.
/// The users of a program with the set-user-ID bit differ.
bool IsOwn(pid_t process);

/// Returns whether the process at a Unix socket takes no connection, or sends nothing on one within
/// the time. A daemon sends its HTTP/2 settings at once. If no process listens there, the result is
/// false.
bool IsMute(const std::string& socket_path, std::chrono::milliseconds time);

/// Returns whether a thread of the process has real-time priority, or nothing if this user may not
/// see that.
std::optional<bool> HasRealtimeThread(pid_t process);

/// Returns how many descriptors the process may have open, or nothing if this user may not see
/// that.
std::optional<uint64_t> DescriptorLimit(pid_t process);

}  // namespace carillon::cli
