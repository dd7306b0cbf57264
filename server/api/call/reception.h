// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <type_traits>

#include "server/api/call/call_events.h"
#include "server/api/call/stream_call.h"
#include "server/api/call/thread_pool.h"
#include "server/api/edge/access/access_control.h"
#include "server/api/edge/client_limits.h"

namespace carillon {

/// The access control, limits and threads that every call passes through before its work begins,
/// and the log of what calls have done.
struct Reception {
  AccessControl& access;
  ClientLimits& limits;
  ThreadPool& pool;
  CallEvents& events;
};

/// A call that is refused before its work begins.
template <typename Reactor>
class RefusedCall final : public StreamCall<Reactor> {
 public:
  explicit RefusedCall(const absl::Status& status) : StreamCall<Reactor>(nullptr) {
    this->End(status);
  }
};

/// Returns the reactor of a streaming call that `make()` makes if the caller has the role.
/// `function` is the function that serves the call.
template <typename Make>
auto Open(const grpc::CallbackServerContext& context, const Reception& reception, Role role,
          Make make, const char* function = __builtin_FUNCTION()) -> decltype(make()) {
  const absl::Status admitted = reception.access.Admit(context, role, function).status();
  if (admitted.ok()) return make();
  return new RefusedCall<std::remove_pointer_t<decltype(make())>>(admitted);
}

/// The role that a call needs, and the place that it holds.
struct CallNeeds {
  Role role;
  Holding holding;
};

/// Returns the reactor of a streaming call that holds a place of its client (ClientLimits).
/// `make(caller, place)` makes the reactor and takes the place.
template <typename Make>
auto Open(const grpc::CallbackServerContext& context, const Reception& reception,
          const CallNeeds& needs, Make make, const char* function = __builtin_FUNCTION())
    -> decltype(make(Principal(), ClientPlace())) {
  using Reactor = std::remove_pointer_t<decltype(make(Principal(), ClientPlace()))>;
  const absl::StatusOr<Principal> caller = reception.access.Admit(context, needs.role, function);
  if (!caller.ok()) return new RefusedCall<Reactor>(caller.status());
  absl::StatusOr<ClientPlace> place = reception.limits.Take(needs.holding, caller->client);
  if (!place.ok()) {
    return new RefusedCall<Reactor>(reception.access.Refuse(context, function, place.status()));
  }
  return make(*caller, *std::move(place));
}

}  // namespace carillon
