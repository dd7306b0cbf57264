// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <functional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/exception_barrier.h"
#include "server/api/call/status_conversion.h"
#include "server/api/call/thread_pool.h"
#include "server/base/mutex.h"

namespace carillon {

/// The base classes of every streaming call of the API. A call derives from ClientStream,
/// ServerStream or BidiStream, and deletes itself when it is done. The base classes keep one
/// request and one response at a time, so only a subclass can need more memory.

/// Runs the steps of a call on a thread pool or, without a pool, on the thread that caused them.
template <typename Reactor>
class StreamCall : public Reactor {
 public:
  void OnDone() final { delete this; }

 protected:
  /// A call whose steps may block needs a `pool`, which must outlive the call. For other calls
  /// `pool` may be null.
  explicit StreamCall(ThreadPool* pool) : pool_(pool) {}

  void Run(std::function<void()> step) {
    if (pool_ == nullptr) return step();
    pool_->Run(std::move(step));
  }

  /// Ends the call. A step must return after End, because the call may be deleted at once.
  void End(const absl::Status& status) { this->Finish(ToGrpcStatus(status)); }

 private:
  ThreadPool* const pool_;
};

/// The reading half of a call, which takes one request after the other. gRPC hands over
/// unparsed bytes, because one of gRPC's few threads would be busy for long if it parsed a large
/// request.
template <typename Reactor, typename Request>
class StreamReader : public Reactor {
 public:
  void OnReadDone(bool ok) final {
    if (!GoesOn()) return;
    if (ok) return RunReading(bytes_.Length(), [this] { ReadRequest(); });
    this->Run([this] {
      Continue([this] {
        AllRead();
        return absl::OkStatus();
      });
    });
  }

 protected:
  using Reactor::Reactor;

  /// Takes a request. After an error, Refuse is called with the error and no further request is
  /// read.
  virtual absl::Status Take(const Request& request) = 0;

  /// Called when the client has sent all its requests or has cancelled the call.
  virtual void AllRead() = 0;

  /// Returns whether the client has cancelled the call or died. A request that waited for a thread
  /// is then not taken.
  virtual bool gone() const { return false; }

  virtual void Refuse(const absl::Status& status) { this->End(status); }

  /// Runs the step that parses a request of this size and takes it. A call may choose other threads
  /// than those of its pool. Requests are still taken one at a time and in order, because the next
  /// request is read after the last step.
  virtual void RunReading(size_t, std::function<void()> step) { this->Run(std::move(step)); }

  /// Returns false if the call was ended while it waited for a request. The call may then be
  /// deleted as soon as GoesOn returns, so no step may be left to the pool. Called on gRPC's
  /// threads.
  virtual bool GoesOn() { return true; }

  /// Must be the last step of a call's constructor.
  void StartReading() { this->StartRead(&bytes_); }

 private:
  /// A call keeps the memory of its last request for the next one, up to about this size.
  static constexpr size_t kMostKeptBytes = size_t{64} << 10;

  void ReadRequest() {
    Continue([this] {
      if (gone()) return absl::CancelledError("the client has gone");
      const bool is_large = bytes_.Length() > kMostKeptBytes;
      const grpc::Status parsed =
          grpc::SerializationTraits<Request>::Deserialize(&bytes_, &request_);
      if (!parsed.ok()) return Malformed();
      RETURN_IF_ERROR(Take(request_));
      if (is_large) Request().Swap(&request_);
      StartReading();
      return absl::OkStatus();
    });
  }

  /// Calls `step()`, after which the call may be deleted, unless the step returns an error.
  template <typename Step>
  void Continue(Step step) {
    const absl::Status status = WithoutExceptions(step);
    if (!status.ok()) Refuse(status);
  }

  static absl::Status Malformed() {
    return Refusal(absl::StatusCode::kInvalidArgument, "REQUEST_MALFORMED",
                   "a message of the stream cannot be parsed: send messages of the type that the "
                   "contract names");
  }

  grpc::ByteBuffer bytes_;
  Request request_;
};

/// Whether a call has a message to send.
enum class Supply {
  kMessage,  ///< the response that was filled in
  kLater,    ///< nothing yet; Wake is called when there is a message
  kEnd,      ///< nothing more; the call ends with OK
};

/// The writing half of a call. It sends one response after the other, and fills in each response
/// when the previous one has been sent.
///
/// At most one thread at a time has the turn, which is the right to fill in a response, to let gRPC
/// write it, or to end the call. A call begins with the turn, keeps it while gRPC writes, and gives
/// it back when there is nothing to send; after that Wake takes it. A cancelled call ends with
/// CANCELLED, either at once if no thread has the turn, or by the thread that has it.
template <typename Reactor, typename Response>
class StreamWriter : public Reactor {
 public:
  void OnWriteDone(bool ok) final {
    if (!ok && ends_by_cancellation()) return this->End(Cancelled());
    this->Run([this] { WriteNext(); });
  }

  void OnCancel() final {
    if (!ends_by_cancellation()) return;
    {
      const MutexLock lock(&mutex_);
      cancelled_ = true;
      if (std::exchange(taken_, true)) return;
    }
    this->End(Cancelled());
  }

 protected:
  using Reactor::Reactor;

  /// Fills in the next response, which still has the content of the last one. An error ends the
  /// call.
  virtual absl::StatusOr<Supply> Fill(Response& response) = 0;

  /// Returns whether a cancelled call ends by itself. If not, it goes on until Fill returns kEnd or
  /// an error, because its reading half may still be at work.
  virtual bool ends_by_cancellation() const { return true; }

  /// Sends the first response. Until then the constructor has the turn or, in a call that writes
  /// only after all requests are read, the reading half. The reading half may call End instead.
  void StartWriting() {
    this->Run([this] { WriteNext(); });
  }

  /// Notes that there may be a message to send. Any thread may call Wake while the call exists.
  void Wake() {
    {
      const MutexLock lock(&mutex_);
      woken_ = true;
      if (std::exchange(taken_, true)) return;
    }
    this->Run([this] { WriteNext(); });
  }

  /// Returns whether the call was cancelled. A long Fill may then return any error.
  bool is_cancelled() {
    const MutexLock lock(&mutex_);
    return cancelled_;
  }

 private:
  static absl::Status Cancelled() { return absl::CancelledError("the client has gone"); }

  void WriteNext() {
    absl::StatusOr<Supply> supply = Supply::kLater;
    do {
      if (BeginTurn()) return this->End(Cancelled());
      supply = WithoutExceptions([this] { return Fill(response_); });
    } while (supply.ok() && *supply == Supply::kLater && !GiveBackTurn());
    if (!supply.ok()) return this->End(supply.status());
    if (*supply == Supply::kEnd) return this->End(absl::OkStatus());
    if (*supply == Supply::kMessage) this->StartWrite(&response_);
  }

  /// Returns whether the call was cancelled, and forgets the calls of Wake so far, to which the
  /// turn answers.
  bool BeginTurn() {
    const MutexLock lock(&mutex_);
    woken_ = false;
    return cancelled_;
  }

  /// Returns false, and keeps the turn, if the call was woken or cancelled meanwhile.
  bool GiveBackTurn() {
    const MutexLock lock(&mutex_);
    taken_ = woken_ || cancelled_;
    return !taken_;
  }

  Response response_;  // must not be touched while gRPC writes
  Mutex mutex_;
  bool taken_ ABSL_GUARDED_BY(mutex_) = true;
  bool woken_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
};

template <typename Request>
using ClientStream = StreamReader<StreamCall<grpc::ServerReadReactor<grpc::ByteBuffer>>, Request>;

template <typename Response>
using ServerStream = StreamWriter<StreamCall<grpc::ServerWriteReactor<Response>>, Response>;

template <typename Request, typename Response>
using BidiStream = StreamWriter<
    StreamReader<StreamCall<grpc::ServerBidiReactor<grpc::ByteBuffer, Response>>, Request>,
    Response>;

}  // namespace carillon
