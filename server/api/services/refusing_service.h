// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/call/reception.h"

namespace carillon {

/// Ends each call with ResourceExhausted (TOO_MANY_CONNECTIONS), because there is no place for its
/// connection.
class RefusingService final : public grpc::CallbackGenericService {
 public:
  /// `why(peer)` returns the reason. Any thread may call it.
  explicit RefusingService(std::function<std::string(const std::string& peer)> why)
      : why_(std::move(why)) {}

 private:
  grpc::ServerGenericBidiReactor* CreateReactor(
      grpc::GenericCallbackServerContext* context) override {
    return new RefusedCall<grpc::ServerGenericBidiReactor>(Refusal(
        absl::StatusCode::kResourceExhausted, "TOO_MANY_CONNECTIONS",
        absl::StrCat("the daemon has no place for another connection of this process or address: ",
                     why_(context->peer()),
                     "; end some connections, or give the daemon a larger --client-share")));
  }

  const std::function<std::string(const std::string& peer)> why_;
};

}  // namespace carillon
