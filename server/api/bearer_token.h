// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>

namespace carillon {

/// Returns the token that a caller sends in the metadata "authorization" as "Bearer TOKEN"; empty
/// if the caller sends none.
std::string BearerToken(const grpc::CallbackServerContext& context);

}  // namespace carillon
