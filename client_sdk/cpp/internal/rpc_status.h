// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"

namespace carillon::client {

/// The refusal that a call to `server` ended with: from the rich status in its trailing metadata
/// (carillon.v1.StatusDetails), or, where none answered, SERVER_UNAVAILABLE or SERVER_TIMEOUT.
absl::Status FromRpc(const grpc::Status& status, const std::string& server);

}  // namespace carillon::client
