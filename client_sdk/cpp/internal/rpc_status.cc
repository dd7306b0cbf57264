// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/rpc_status.h"

#include "absl/strings/str_cat.h"
#include "carillon/v1/error.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon::client {

absl::Status FromRpc(const grpc::Status& status, const std::string& server) {
  if (status.ok()) return absl::OkStatus();
  // gRPC's codes and absl's are the same numbers.
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  v1::StatusDetails details;
  if (details.ParseFromString(status.error_details())) {
    for (const google::protobuf::Any& any : details.details()) {
      if (v1::ErrorInfo error; any.UnpackTo(&error)) return FromErrorInfo(code, error);
    }
  }
  if (code == absl::StatusCode::kUnavailable) {
    return Refusal(code, "SERVER_UNAVAILABLE",
                   absl::StrCat("no carillond answers at ", server, " (", status.error_message(),
                                "); start it there, or name another address"));
  }
  if (code == absl::StatusCode::kDeadlineExceeded) {
    return Refusal(code, "SERVER_TIMEOUT",
                   absl::StrCat(server, " took too long to answer; try again later"));
  }
  return absl::Status(code, status.error_message());
}

}  // namespace carillon::client
