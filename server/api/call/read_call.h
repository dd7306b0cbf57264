// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/call/call_bounds.h"
#include "server/api/call/stream_call.h"

namespace carillon {

/// Reads requests into a `Sink`, which has Status Append(const Request&) and Status
/// Finish(Response&). Both functions run on a thread of the pool, because they write to the disk.
/// A call ends with CLIENT_IDLE when its client is silent for too long, or sends less
/// than 8 KiB for each second in which the call has waited for it.
template <typename Request, typename Response, typename Sink>
class ReadCall final : public ClientStream<Request>, public IdleCall {
 public:
  ReadCall(grpc::CallbackServerContext& context, Response& response, Sink sink, ThreadPool& pool,
           CallBounds bounds)
      : ClientStream<Request>(&pool),
        context_(context),
        response_(response),
        sink_(std::move(sink)),
        bounds_(std::move(bounds)),
        wait_(bounds_.clock) {
    bounds_.idle_calls.Add(*this);
    this->StartReading();
  }
  ~ReadCall() override { bounds_.idle_calls.Remove(*this); }

  void EndIfIdle(std::chrono::nanoseconds limit) override {
    const double limit_s = std::chrono::duration<double>(limit).count();
    if (wait_.EndIfLonger(limit)) {
      return this->End(
          Refusal(absl::StatusCode::kDeadlineExceeded, "CLIENT_IDLE",
                  absl::StrCat("nothing was sent for ", limit_s,
                               " s, and nothing was stored: send it again without pauses")));
    }
    const std::chrono::seconds earned(byte_count_ / kLeastBytesPerSecond);
    if (!wait_.EndIfAllLonger(limit + earned)) return;
    this->End(Refusal(absl::StatusCode::kDeadlineExceeded, "CLIENT_IDLE",
                      absl::StrCat("it took over ", limit_s,
                                   " s longer than at 8 KiB a second, and nothing was stored: "
                                   "send it again over a faster connection")));
  }

 private:
  bool gone() const override { return context_.IsCancelled(); }

  static constexpr uint64_t kLeastBytesPerSecond = 8 << 10;

  absl::Status Take(const Request& request) override {
    byte_count_ += request.ByteSizeLong();
    absl::Status status = sink_.Append(request);
    if (status.ok()) wait_.Begin();
    return status;
  }

  bool GoesOn() override { return wait_.Resume(); }

  void AllRead() override {
    if (gone()) return this->End(absl::CancelledError("the client has gone"));
    this->End(sink_.Finish(response_));
  }

  grpc::CallbackServerContext& context_;
  Response& response_;
  Sink sink_;
  CallBounds bounds_;
  ClientWait wait_;
  std::atomic<uint64_t> byte_count_{0};
};

}  // namespace carillon
