// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// Returns `address`, which is HOST:PORT, with the IPv4 address of its host, and binds a socket
/// there for a moment. Debian's civetweb knows no IPv6 and does not say why it cannot listen.
/// Errors: FailedPrecondition (LISTEN_FAILED).
absl::StatusOr<std::string> FindMetricsAddress(const std::string& address);

/// Checks the address while a daemon may be serving there. Errors: FailedPrecondition
/// (LISTEN_FAILED), as FindMetricsAddress.
absl::Status CheckMetricsAddress(const std::string& address);

}  // namespace carillon
