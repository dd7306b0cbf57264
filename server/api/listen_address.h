// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

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
  /// Whether only this machine can reach the address.
  bool is_local() const;
  /// The address as text: "unix:PATH", "HOST:PORT" or "[HOST]:PORT".
  std::string ToString() const;
};

/// Errors: InvalidArgument (INVALID_ADDRESS).
absl::StatusOr<ListenAddress> ParseListenAddress(absl::string_view text);

/// Makes the folder of a Unix socket, for its owner only, and checks that no running daemon serves
/// the socket. Errors: FailedPrecondition (LISTEN_FAILED, ADDRESS_IN_USE).
absl::Status PrepareSocket(const std::string& path);

}  // namespace carillon
