// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>

#include "carillon/v1/audio_service.pb.h"
#include "server/api/thread_pool.h"
#include "server/mode_database/model_store.h"
#include "server/scene/sounding_body.h"

namespace carillon {

/// What rendering offline needs of the daemon.
struct RenderContext {
  ModelStore& models;
  BodyCache& bodies;
  ThreadPool& pool;
  /// Render calls there are.
  std::atomic<int>& call_count;
};

/// AudioService.Render: deletes itself when the call is done. What `daemon` names must outlive the
/// call.
grpc::ServerBidiReactor<v1::RenderRequest, v1::RenderResponse>* MakeRenderCall(
    const RenderContext& daemon);

}  // namespace carillon
