// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <string>

#include "proto/cpp/server_address.h"

namespace carillon::client {

/// Whether the text can be sent as metadata: printable ASCII.
inline bool IsSendable(const std::string& token) {
  return std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// Adds the token to a call of the daemon at `server`. Adds nothing if the token is empty or is not
/// sendable. gRPC ends the call, before the token is sent, if another machine could read it: if the
/// connection has no TLS and leaves this machine (FromRpc, TLS_REQUIRED).
inline void Authorize(grpc::ClientContext& context, const std::string& server,
                      const std::string& token) {
  if (token.empty() || !IsSendable(token)) return;
  if (IsOnThisMachine(server)) {
    context.AddMetadata("authorization", "Bearer " + token);
  } else {
    context.set_credentials(grpc::AccessTokenCredentials(token));
  }
}

}  // namespace carillon::client
