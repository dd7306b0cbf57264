// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>
#include <type_traits>
#include <utility>

#include "server/api/exception_barrier.h"
#include "server/api/fair_pool.h"
#include "server/api/reception.h"
#include "server/api/status_conversion.h"

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

/// Answers a call that needs a role, in the same way. If the work needs the caller, it may be
/// `work(const Principal&)`.
template <typename Work>
grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, const Reception& reception,
                                 Role role, Work work) {
  absl::StatusOr<Principal> caller = reception.access.Admit(*context, role);
  if (!caller.ok()) {
    grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
    reactor->Finish(ToGrpcStatus(caller.status()));
    return reactor;
  }
  if constexpr (std::is_invocable_v<const Work&, const Principal&>) {
    return Answer(context, reception.pool,
                  [caller = *std::move(caller), work = std::move(work)] { return work(caller); });
  } else {
    return Answer(context, reception.pool, std::move(work));
  }
}

/// Answers a call that keeps a thread busy for long, `work(const Principal&)`, on threads that the
/// clients share fairly.
template <typename Work>
grpc::ServerUnaryReactor* AnswerFairly(grpc::CallbackServerContext* context,
                                       const Reception& reception, Role role, FairPool& pool,
                                       Work work) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  absl::StatusOr<Principal> caller = reception.access.Admit(*context, role);
  if (!caller.ok()) {
    reactor->Finish(ToGrpcStatus(caller.status()));
    return reactor;
  }
  const std::string client = caller->client;
  pool.Run(client, [reactor, caller = *std::move(caller), work = std::move(work)] {
    reactor->Finish(ToGrpcStatus(WithoutExceptions([&] { return work(caller); })));
  });
  return reactor;
}

}  // namespace carillon
