// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "carillon/v1/audio_service.pb.h"
#include "server/api/client_limits.h"
#include "server/live_output/live_output.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Makes the server's side of one call of AudioService.Listen. The returned reactor holds `place`,
/// and deletes itself when the call ends. `output` and `scenes` must outlive the reactor.
grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(LiveOutput& output,
                                                             const SceneRegistry& scenes,
                                                             const v1::ListenRequest& request,
                                                             ClientPlace place);

}  // namespace carillon
