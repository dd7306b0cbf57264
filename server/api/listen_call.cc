// SPDX-License-Identifier: Apache-2.0
#include "server/api/listen_call.h"

#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "server/api/sample_bytes.h"
#include "server/api/status_conversion.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

/// Writes one block at a time; what comes meanwhile waits in the listener's bounded queue.
class ListenCall final : public grpc::ServerWriteReactor<v1::ListenResponse> {
 public:
  explicit ListenCall(LiveOutput& output) {
    absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> listener =
        output.broadcast().Subscribe([this] { Wake(); });
    const MutexLock lock(&mutex_);
    if (!listener.ok()) {
      End(ToGrpcStatus(listener.status()));
      return;
    }
    listener_ = *std::move(listener);
    response_.mutable_format()->set_sample_rate_hz(output.format().sample_rate_hz);
    response_.mutable_format()->set_channel_count(output.format().channel_count);
    writing_ = true;
    StartWrite(&response_);
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(&mutex_);
    writing_ = false;
    if (!ok || cancelled_) return End(grpc::Status::CANCELLED);
    Next();
  }

  void OnCancel() override {
    const MutexLock lock(&mutex_);
    cancelled_ = true;
    if (!writing_) End(grpc::Status::CANCELLED);
  }

  void OnDone() override { delete this; }

 private:
  void Wake() {
    const MutexLock lock(&mutex_);
    Next();
  }

  void Next() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (writing_ || finished_ || !listener_) return;
    const std::shared_ptr<const RenderedBlock> block = listener_->TryTake();
    if (!block) return;
    response_.clear_format();
    response_.mutable_block()->set_first_frame(block->first_frame);
    response_.mutable_block()->set_samples(ToBytes(block->samples));
    response_.set_lost_frame_count(listener_->lost_frame_count());
    writing_ = true;
    StartWrite(&response_);
  }

  void End(const grpc::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  Mutex mutex_;
  v1::ListenResponse response_;  // gRPC's while writing_
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  /// Last, so that it ends before what Wake touches.
  std::unique_ptr<BlockBroadcast::Listener> listener_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace

grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(LiveOutput& output) {
  return new ListenCall(output);
}

}  // namespace carillon
