// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "carillon/v1/audio_service.pb.h"
#include "server/live_output/live_output.h"

namespace carillon {

/// AudioService.Listen: deletes itself when the call is done. `output` must outlive the call.
grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(LiveOutput& output);

}  // namespace carillon
