// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <utility>

#include "server/api/exception_barrier.h"
#include "server/api/status_conversion.h"
#include "server/api/thread_pool.h"

namespace carillon {

/// Answers a call with one request and one response. `work()` runs on a thread of the pool, fills
/// in the response and returns an absl::Status. gRPC keeps request and response until the call is
/// finished.
template <typename Work>
grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, ThreadPool& pool,
                                 Work work) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  pool.Run([reactor, work = std::move(work)] {
    reactor->Finish(ToGrpcStatus(WithoutExceptions(work)));
  });
  return reactor;
}

}  // namespace carillon
