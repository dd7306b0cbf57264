// SPDX-License-Identifier: Apache-2.0
#include "server/api/bearer_token.h"

#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace carillon {

std::string BearerToken(const grpc::CallbackServerContext& context) {
  const auto shown = context.client_metadata().find("authorization");
  if (shown == context.client_metadata().end()) return "";
  absl::string_view token(shown->second.data(), shown->second.size());
  return absl::ConsumePrefix(&token, "Bearer ") ? std::string(token) : "";
}

}  // namespace carillon
