// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"

namespace carillon::client {

/// Converts the status of a call to `server` into a refusal. The reason comes from the rich status
/// in the trailing metadata (carillon.v1.StatusDetails); if no daemon answered, it is
/// SERVER_UNAVAILABLE or SERVER_TIMEOUT.
absl::Status FromRpc(const grpc::Status& status, const std::string& server);

}  // namespace carillon::client
