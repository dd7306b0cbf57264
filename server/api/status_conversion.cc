// SPDX-License-Identifier: Apache-2.0
#include "server/api/status_conversion.h"

#include <string>

#include "carillon/v1/error.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const std::string message(status.message());
  v1::StatusDetails details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(message);
  details.add_details()->PackFrom(ToErrorInfo(status));
  // absl and gRPC use the same numbers for the same codes.
  return {static_cast<grpc::StatusCode>(status.code()), message, details.SerializeAsString()};
}

}  // namespace carillon
