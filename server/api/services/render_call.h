// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "carillon/v1/audio_service.pb.h"
#include "server/api/call/thread_pool.h"
#include "server/api/edge/client_limits.h"
#include "server/api/edge/idle_calls.h"
#include "server/base/clock.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/head_store.h"
#include "server/scene/sounding_body.h"

namespace carillon {

/// The parts of the daemon that offline rendering uses.
struct RenderContext {
  ModeDatabase& database;
  HeadStore& heads;
  BodyCache& bodies;
  ThreadPool& pool;
  const Clock& clock;
  IdleCalls& idle_calls;
};

/// The places that a rendering holds.
struct RenderPlaces {
  ClientPlace call;
  ClientPlace memory;  ///< of the kind kRenderingMib; grows with the objects
};

/// Makes a call of AudioService.Render, which holds `places` and deletes itself when it is done.
/// The call is added to the idle calls of `daemon`, whose parts must outlive the call.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::RenderResponse>* MakeRenderCall(
    const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places);

}  // namespace carillon
