// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <type_traits>
#include <utility>

#include "server/api/call/exception_barrier.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/reception.h"
#include "server/api/call/status_conversion.h"

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

/// Answers a call whose caller is admitted or refused. `run(const Principal&, step)` runs the step
/// on a thread that may block.
template <typename Run, typename Work>
grpc::ServerUnaryReactor* AnswerAdmitted(grpc::CallbackServerContext* context,
                                         const absl::StatusOr<Principal>& caller, Run run,
                                         Work work) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (!caller.ok()) {
    reactor->Finish(ToGrpcStatus(caller.status()));
    return reactor;
  }
  run(*caller, [reactor, caller = *caller, work = std::move(work)] {
    reactor->Finish(ToGrpcStatus(WithoutExceptions([&] {
      if constexpr (std::is_invocable_v<const Work&, const Principal&>) {
        return work(caller);
      } else {
        return work();
      }
    })));
  });
  return reactor;
}

/// Answers a call that needs a role on a thread of the reception's pool. If the work needs the
/// caller, it may be `work(const Principal&)`. `function` is the function that serves the call.
template <typename Work>
grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, const Reception& reception,
                                 Role role, Work work,
                                 const char* function = __builtin_FUNCTION()) {
  const auto run = [&](const Principal&, std::function<void()> step) {
    reception.pool.Run(std::move(step));
  };
  return AnswerAdmitted(context, reception.access.Admit(*context, role, function), run,
                        std::move(work));
}

/// The same for a call that needs the role strike and keeps a thread busy for long. The clients
/// share the threads of `turns` fairly.
template <typename Work>
grpc::ServerUnaryReactor* AnswerFairly(grpc::CallbackServerContext* context,
                                       const Reception& reception, FairTurns& turns, Work work,
                                       const char* function = __builtin_FUNCTION()) {
  const auto run = [&](const Principal& caller, std::function<void()> step) {
    turns.Run(caller.client, std::move(step));
  };
  return AnswerAdmitted(context, reception.access.Admit(*context, Role::kStrike, function), run,
                        std::move(work));
}

}  // namespace carillon
