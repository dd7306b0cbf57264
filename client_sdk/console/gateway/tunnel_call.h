// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace carillon::console {

/// One gRPC call of any kind, carried as bytes. A unary call is a stream with one message each way.
///
/// Threading: all methods may be called on any thread. The callbacks run on gRPC's threads, one at
/// a time.
class TunnelCall final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  struct Callbacks {
    /// Gets a message of the server. No further message is read until ReadNext() is called.
    std::function<void(std::string bytes)> on_message;
    /// Gets the status, after the last message. It is the last callback. It must let go of `call`
    /// on another thread than gRPC's, because the last call of a channel takes the channel with it.
    std::function<void(const grpc::Status&, std::shared_ptr<TunnelCall> call)> on_end;
  };

  /// Starts a call of `method` ("/package.Service/Method") and reads its first message. `token`, if
  /// it is not empty, goes with the call as "authorization: Bearer TOKEN". The call keeps itself
  /// alive until it has ended.
  static std::shared_ptr<TunnelCall> Start(const std::shared_ptr<grpc::Channel>& channel,
                                           const std::string& method, const std::string& token,
                                           Callbacks callbacks);

  /// Sends a message after those that wait. Once the call has ended, messages are dropped.
  void Send(std::string_view bytes);

  /// Tells the server that no further message follows.
  void HalfClose();

  /// Ends the call; on_end gets the status CANCELLED unless the call has ended already.
  void Cancel();

  /// Lets the next message be read, after on_message.
  void ReadNext();

  /// Returns the bytes that wait to be sent.
  size_t WaitingBytes() const;

 private:
  explicit TunnelCall(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  /// Starts the next write or the half-close if nothing is being written.
  void WriteNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  Callbacks callbacks_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericStub> stub_;
  std::shared_ptr<TunnelCall> self_;
  grpc::ByteBuffer incoming_;
  mutable absl::Mutex mutex_;
  std::deque<grpc::ByteBuffer> outgoing_ ABSL_GUARDED_BY(mutex_);
  size_t waiting_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool half_close_wanted_ ABSL_GUARDED_BY(mutex_) = false;
  bool half_closed_ ABSL_GUARDED_BY(mutex_) = false;
  bool reading_ ABSL_GUARDED_BY(mutex_) = false;
  /// After the last read the hold that lets other threads start operations is gone.
  bool over_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace carillon::console
