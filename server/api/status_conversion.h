// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace carillon {

/// Converts `status` to a gRPC status of the same code and message. The details of the gRPC status
/// are a serialized carillon.v1.StatusDetails with reason, message and figures. gRPC sends the
/// details as "grpc-status-details-bin".
grpc::Status ToGrpcStatus(const absl::Status& status);

}  // namespace carillon
