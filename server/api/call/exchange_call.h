// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/exception_barrier.h"
#include "server/api/call/stream_call.h"
#include "server/api/call/thread_pool.h"

namespace carillon {

/// The base of a bidirectional call that takes turns with its client: it takes a request, sends all
/// responses that follow from it, and only then reads the next request. A client that does not read
/// is therefore not worked for, and takes no memory. At most one read, write or task of the pool is
/// under way at a time, so a call needs no lock; a cancelled call ends when that one is done.
template <typename Request, typename Response>
class ExchangeCall : public StreamCall<grpc::ServerBidiReactor<grpc::ByteBuffer, Response>> {
 public:
  void OnReadDone(bool ok) final {
    if (!Resume()) return;
    this->Run([this, ok] { TakeTurn(ok); });
  }

  void OnWriteDone(bool ok) final {
    if (!Resume() || !ok) return this->End(Cancelled());
    this->Run([this] { Answer(); });
  }

 protected:
  ExchangeCall(grpc::CallbackServerContext& context, ThreadPool& pool)
      : StreamCall<grpc::ServerBidiReactor<grpc::ByteBuffer, Response>>(&pool), context_(context) {}

  /// Takes a request. An error ends the call.
  virtual absl::Status Take(const Request& request) = 0;

  /// Called when the client has sent all its requests. Fill must return kEnd some time after it. An
  /// error ends the call.
  virtual absl::Status AllRead() { return absl::OkStatus(); }

  /// Fills in the next response, which still has the content of the last one. kLater lets the
  /// client send the next request. An error ends the call.
  virtual absl::StatusOr<Supply> Fill(Response& response) = 0;

  /// Called before the call waits for its client, which is to read if `writes` and to send
  /// otherwise.
  virtual void Await([[maybe_unused]] bool writes) {}

  /// Called when the call has waited. If it returns false, the call was ended meanwhile, and may be
  /// deleted at once if it did not write.
  virtual bool Resume() { return true; }

  grpc::CallbackServerContext& context() { return context_; }

  /// Must be the last step of a call's constructor.
  void StartReading() {
    Await(false);
    this->StartRead(&bytes_);
  }

 private:
  static absl::Status Cancelled() { return absl::CancelledError("the client has gone"); }

  void TakeTurn(bool has_request) {
    const absl::Status status = WithoutExceptions([&]() -> absl::Status {
      if (context_.IsCancelled()) return Cancelled();
      if (!has_request) return AllRead();
      RETURN_IF_ERROR(Parse());
      return Take(request_);
    });
    if (!status.ok()) return this->End(status);
    Answer();
  }

  absl::Status Parse() {
    if (grpc::SerializationTraits<Request>::Deserialize(&bytes_, &request_).ok()) {
      return absl::OkStatus();
    }
    return Refusal(absl::StatusCode::kInvalidArgument, "REQUEST_MALFORMED",
                   "a message of the stream cannot be parsed: send messages of the type that the "
                   "contract names");
  }

  void Answer() {
    const absl::StatusOr<Supply> supply = WithoutExceptions([this] { return Fill(response_); });
    if (!supply.ok()) return this->End(supply.status());
    if (*supply == Supply::kEnd) return this->End(absl::OkStatus());
    if (*supply == Supply::kLater) return StartReading();
    Await(true);
    this->StartWrite(&response_);
  }

  grpc::CallbackServerContext& context_;
  grpc::ByteBuffer bytes_;
  Request request_;
  Response response_;  // must not be touched while gRPC writes
};

}  // namespace carillon
