// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <utility>

#include "absl/status/status.h"
#include "server/api/call/call_bounds.h"
#include "server/api/call/stream_call.h"

namespace carillon {

/// A call that sends a large content in many messages. The next message is read from the disk, on a
/// thread of the pool, when gRPC has taken the previous one. The call is cancelled if its client
/// does not read for too long.
template <typename Response>
class SendCall : public ServerStream<Response>, public IdleCall {
 public:
  SendCall(grpc::CallbackServerContext& context, CallBounds bounds, ThreadPool& pool)
      : ServerStream<Response>(&pool),
        context_(context),
        bounds_(std::move(bounds)),
        wait_(bounds_.clock) {
    wait_.Resume();  // nothing has been sent that the client could read
    bounds_.idle_calls.Add(*this);
  }
  ~SendCall() override { bounds_.idle_calls.Remove(*this); }

  /// Cancels the call, because a call cannot be finished while gRPC writes a message.
  void EndIfIdle(std::chrono::nanoseconds limit) final {
    if (wait_.EndIfLonger(limit)) context_.TryCancel();
  }

 protected:
  /// Does what Fill of a StreamWriter does.
  virtual absl::StatusOr<Supply> FillNext(Response& response) = 0;

 private:
  absl::StatusOr<Supply> Fill(Response& response) final {
    if (!wait_.Resume()) return absl::CancelledError("the client has not read for too long");
    absl::StatusOr<Supply> supply = FillNext(response);
    wait_.Begin();
    return supply;
  }

  grpc::CallbackServerContext& context_;
  CallBounds bounds_;
  ClientWait wait_;
};

}  // namespace carillon
