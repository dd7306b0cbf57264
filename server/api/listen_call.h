// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "carillon/v1/audio_service.pb.h"
#include "server/live_output/live_output.h"

namespace carillon {

/// Makes a call of AudioService.Listen, which deletes itself when it is done. `output` must outlive
/// it.
grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(LiveOutput& output);

}  // namespace carillon
