// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "server/api/stream_call.h"

namespace carillon {

/// Reads requests into a `Sink`, which has Status Append(const Request&) and Status
/// Finish(Response&). Both functions run on a thread of the pool, because they write to the disk.
template <typename Request, typename Response, typename Sink>
class ReadCall final : public ClientStream<Request> {
 public:
  ReadCall(grpc::CallbackServerContext& context, Response& response, Sink sink, ThreadPool& pool)
      : ClientStream<Request>(&pool),
        context_(context),
        response_(response),
        sink_(std::move(sink)) {
    this->StartReading();
  }

 private:
  absl::Status Take(const Request& request) override {
    if (context_.IsCancelled()) return absl::CancelledError("the client has gone");
    return sink_.Append(request);
  }

  void AllRead() override {
    if (context_.IsCancelled()) return this->End(absl::CancelledError("the client has gone"));
    this->End(sink_.Finish(response_));
  }

  grpc::CallbackServerContext& context_;
  Response& response_;
  Sink sink_;
};

}  // namespace carillon
