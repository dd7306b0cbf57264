// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>

namespace carillon {

/// What a caller shows in the metadata "authorization" as "Bearer TOKEN"; empty: nothing.
std::string BearerToken(const grpc::CallbackServerContext& context);

}  // namespace carillon
