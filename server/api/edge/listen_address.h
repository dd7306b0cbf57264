// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// An address at which the server listens.
struct ListenAddress {
  /// Path of a Unix socket; empty for TCP.
  std::string socket_path;
  /// Host of a TCP address, without brackets.
  std::string host;
  int port = 0;

  bool is_unix() const { return !socket_path.empty(); }
  /// Returns whether only this machine can reach the address.
  bool is_local() const;
  /// Returns the address as "unix:PATH", "HOST:PORT" or "[HOST]:PORT".
  std::string ToString() const;
};

/// Parses an address. Errors: InvalidArgument (INVALID_CONFIGURATION).
absl::StatusOr<ListenAddress> ParseListenAddress(absl::string_view text);

/// Checks what PrepareSocket would find, without making or removing anything. Errors: those of
/// PrepareSocket, but for a socket that another daemon serves.
absl::Status CheckSocket(const std::string& path);

/// Makes the folder of a Unix socket, for its owner only, unless it exists. Removes a socket that
/// no running daemon serves. Returns the mode for the new socket, which is 0660 if only a group may
/// enter the folder, and otherwise 0600. Errors: FailedPrecondition (LISTEN_FAILED: also
/// if another user owns the folder, or could replace the socket in it).
absl::StatusOr<mode_t> PrepareSocket(const std::string& path);

}  // namespace carillon
