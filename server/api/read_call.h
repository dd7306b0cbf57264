// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <utility>

#include "absl/status/status.h"
#include "server/api/status_conversion.h"
#include "server/api/work_pool.h"

namespace carillon {

/// Reads requests into `Sink` one after the other; each is taken on a thread of the pool, since it
/// goes to disk. `Sink` has Status Append(const Request&) and Status Finish(Response&).
template <typename Request, typename Response, typename Sink>
class ReadReactor final : public grpc::ServerReadReactor<Request> {
 public:
  ReadReactor(grpc::CallbackServerContext& context, Response& response, Sink sink, WorkPool& pool)
      : context_(context), response_(response), sink_(std::move(sink)), pool_(pool) {
    this->StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    pool_.Run([this, ok] { Take(ok); });
  }

  void OnDone() override { delete this; }

 private:
  void Take(bool ok) {
    if (context_.IsCancelled()) return this->Finish(grpc::Status::CANCELLED);
    const absl::Status status = ok ? sink_.Append(request_) : sink_.Finish(response_);
    if (!ok || !status.ok()) return this->Finish(ToGrpcStatus(status));
    this->StartRead(&request_);
  }

  grpc::CallbackServerContext& context_;
  Response& response_;
  Sink sink_;
  WorkPool& pool_;
  Request request_;
};

}  // namespace carillon
