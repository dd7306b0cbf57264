// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/client_context.h>

#include <algorithm>
#include <string>

namespace carillon::client {

/// Whether the text can be sent as metadata: printable ASCII.
inline bool IsSendable(const std::string& token) {
  return std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// Adds the token to the call. Adds nothing if the token is empty or is not sendable.
inline void Authorize(grpc::ClientContext& context, const std::string& token) {
  if (!token.empty() && IsSendable(token)) context.AddMetadata("authorization", "Bearer " + token);
}

}  // namespace carillon::client
