// SPDX-License-Identifier: Apache-2.0
#include "server/api/listen_call.h"

#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "server/api/sample_bytes.h"
#include "server/api/stream_call.h"

namespace carillon {
namespace {

/// Sends the format, then blocks. Blocks that come while one is being sent wait in the listener's
/// bounded queue.
class ListenCall final : public ServerStream<v1::ListenResponse> {
 public:
  ListenCall(LiveOutput& output, ClientPlace place)
      : StreamWriter(nullptr), place_(std::move(place)), format_(output.format()) {
    listener_ = output.broadcast().Subscribe([this] { Wake(); });
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> Fill(v1::ListenResponse& response) override {
    if (!listener_.ok()) return listener_.status();
    if (!std::exchange(format_sent_, true)) {
      response.mutable_format()->set_sample_rate_hz(format_.sample_rate_hz);
      response.mutable_format()->set_channel_count(format_.channel_count);
      return Supply::kMessage;
    }
    const std::shared_ptr<const RenderedBlock> block = (*listener_)->TryTake();
    if (!block) return Supply::kLater;
    response.clear_format();
    response.mutable_block()->set_first_frame(block->first_frame);
    response.mutable_block()->set_samples(ToBytes(block->samples));
    response.set_lost_frame_count((*listener_)->lost_frame_count());
    return Supply::kMessage;
  }

  const ClientPlace place_;
  const DeviceFormat format_;
  bool format_sent_ = false;
  /// Last, so that it is destroyed, and wakes nobody any more, before the rest.
  absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> listener_;
};

}  // namespace

grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(LiveOutput& output,
                                                             ClientPlace place) {
  return new ListenCall(output, std::move(place));
}

}  // namespace carillon
