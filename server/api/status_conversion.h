// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace carillon {

/// The gRPC status of `status`: same code and message; its details are a serialized
/// carillon.v1.StatusDetails with reason, message and figures, which travel as
/// "grpc-status-details-bin".
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace carillon
