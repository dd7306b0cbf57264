// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Where to listen.
struct ListenAddress {
  /// Of a Unix socket; empty for TCP.
  std::string socket_path;
  /// Of TCP, without brackets.
  std::string host;
  int port = 0;

  bool is_unix() const { return !socket_path.empty(); }
  /// Reachable from this machine only.
  bool is_local() const;
  /// As written: "unix:PATH", "HOST:PORT" or "[HOST]:PORT".
  std::string ToString() const;
};

/// Errors: InvalidArgument (INVALID_ADDRESS).
absl::StatusOr<ListenAddress> ParseListenAddress(absl::string_view text);

/// Makes the folder of a Unix socket, for its owner only, and sees that no living daemon holds the
/// socket. Errors: FailedPrecondition (LISTEN_FAILED, ADDRESS_IN_USE).
absl::Status PrepareSocket(const std::string& path);

}  // namespace carillon
