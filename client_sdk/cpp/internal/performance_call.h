// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/client_context.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/performance.h"
#include "carillon/v1/audio_service.grpc.pb.h"

namespace carillon::client {

/// Opens Perform on `stub` with the token and the deadline of `context`, and waits for the answer
/// to `settings`. Error messages name `server`.
absl::StatusOr<std::unique_ptr<Performance>> OpenPerformance(
    v1::AudioService::Stub& stub, const std::string& server,
    std::unique_ptr<grpc::ClientContext> context, const v1::PerformSettings& settings);

}  // namespace carillon::client
