// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/listen_call.h"

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/stream_call.h"
#include "server/api/convert/sample_bytes.h"

namespace carillon {
namespace {

constexpr uint32_t kMostFrames = 65536;

using Listener = BlockBroadcast::Listener;

absl::Status Check(const v1::ListenRequest& request) {
  if (request.block_frame_count() > kMostFrames) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("block_frame_count is ", request.block_frame_count(),
                                "; it must be 0 to ", kMostFrames));
  }
  if (v1::AudioEncoding_IsValid(request.encoding())) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("there is no encoding ", static_cast<int>(request.encoding())));
}

absl::StatusOr<std::unique_ptr<Listener>> Subscribe(LiveOutput& output,
                                                    const absl::StatusOr<std::optional<BusId>>& bus,
                                                    const v1::ListenRequest& request,
                                                    std::function<void()> wake) {
  RETURN_IF_ERROR(Check(request));
  RETURN_IF_ERROR(bus.status());
  return output.Listen(*bus, std::move(wake));
}

/// Sends the format, then blocks. While a block is being sent, further blocks wait in the
/// listener's bounded queue.
class ListenCall final : public ServerStream<v1::ListenResponse> {
 public:
  ListenCall(LiveOutput& output, const absl::StatusOr<std::optional<BusId>>& bus,
             const v1::ListenRequest& request, ClientPlace place)
      : StreamWriter(nullptr),
        place_(std::move(place)),
        format_(output.format()),
        encoding_(request.encoding() == v1::AUDIO_ENCODING_INT16 ? v1::AUDIO_ENCODING_INT16
                                                                 : v1::AUDIO_ENCODING_FLOAT32),
        wanted_(size_t{request.block_frame_count()} * format_.channel_count) {
    if (wanted_ == 0) wanted_ = format_.block_size();
    listener_ = Subscribe(output, bus, request, [this] { Wake(); });
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> Fill(v1::ListenResponse& response) override {
    if (!listener_.ok()) return listener_.status();
    if (!std::exchange(format_sent_, true)) {
      response.mutable_format()->set_sample_rate_hz(format_.sample_rate_hz);
      response.mutable_format()->set_channel_count(format_.channel_count);
      response.mutable_format()->set_encoding(encoding_);
      return Supply::kMessage;
    }
    const bool ended = (*listener_)->ended();
    while (samples_.size() < wanted_ && !gap()) {
      next_ = (*listener_)->TryTake();
      if (!next_) break;
      if (!gap()) Append();
    }
    if (samples_.size() >= wanted_ || gap() || (ended && !samples_.empty())) {
      Send(response);
      return Supply::kMessage;
    }
    return ended ? Supply::kEnd : Supply::kLater;
  }

  /// Returns whether frames are missing between the waiting samples and the block taken last.
  bool gap() const { return next_ && !samples_.empty() && next_->first_frame != end_frame(); }

  uint64_t end_frame() const { return first_frame_ + samples_.size() / format_.channel_count; }

  void Append() {
    if (samples_.empty()) first_frame_ = next_->first_frame;
    samples_.insert(samples_.end(), next_->samples.begin(), next_->samples.end());
    next_ = nullptr;
  }

  void Send(v1::ListenResponse& response) {
    const size_t count = std::min(wanted_, samples_.size());
    const std::span<const float> block = std::span(samples_).first(count);
    response.clear_format();
    response.mutable_block()->set_first_frame(first_frame_);
    response.mutable_block()->set_samples(
        encoding_ == v1::AUDIO_ENCODING_INT16 ? ToInt16Bytes(block) : ToBytes(block));
    response.set_lost_frame_count((*listener_)->lost_frame_count());
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<ptrdiff_t>(count));
    first_frame_ += count / format_.channel_count;
    if (samples_.empty() && next_) Append();
  }

  const ClientPlace place_;
  const DeviceFormat format_;
  const v1::AudioEncoding encoding_;
  size_t wanted_;  // samples in a message
  bool format_sent_ = false;
  std::vector<float> samples_;  // samples that wait, from first_frame_ on
  uint64_t first_frame_ = 0;
  std::shared_ptr<const RenderedBlock> next_;  // a block after a gap
  /// The last member, so that it is destroyed first, and Wake is not called afterwards.
  absl::StatusOr<std::unique_ptr<Listener>> listener_;
};

}  // namespace

grpc::ServerWriteReactor<v1::ListenResponse>* MakeListenCall(
    LiveOutput& output, const absl::StatusOr<std::optional<BusId>>& bus,
    const v1::ListenRequest& request, ClientPlace place) {
  return new ListenCall(output, bus, request, std::move(place));
}

}  // namespace carillon
