// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "carillon/v1/audio_service.pb.h"
#include "server/api/services/render_call.h"

namespace carillon {

/// Makes a call of AudioService.Perform, which holds `places` and deletes itself when it is done.
/// The parts of `daemon` must outlive the call.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PerformResponse>* MakePerformCall(
    const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places);

}  // namespace carillon
