// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <optional>

#include "absl/status/statusor.h"
#include "carillon/v1/audio_service.pb.h"
#include "server/api/edge/client_limits.h"
#include "server/live_output/live_output.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// Makes the server's side of one call of AudioService.Listen. The returned reactor holds `place`,
/// and deletes itself when the call ends. `bus` is the bus of the request's scene, or nothing for
/// the output. If `bus` is an error, the call ends with it. `output` must outlive the reactor.
grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(
    LiveOutput& output, const absl::StatusOr<std::optional<BusId>>& bus,
    const v1::ListenRequest& request, ClientPlace place);

}  // namespace carillon
