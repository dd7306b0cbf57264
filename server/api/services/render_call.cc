// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/render_call.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/exchange_call.h"
#include "server/api/call/status_conversion.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/contact_warnings.h"
#include "server/api/convert/sample_bytes.h"
#include "server/api/convert/trace_reader.h"
#include "server/loudness/loudness_meter.h"

namespace carillon {
namespace {

/// 64 blocks (32 KiB for one channel) give few messages, and let the thread serve the next call
/// soon.
constexpr size_t kFramesPerMessage = 64 * OfflineRenderer::kBlockFrameCount;
constexpr size_t kBlowsPerMessage = 1000;
/// When the events of a trace take more memory than this, the call renders what can no longer
/// change before it reads on. A client that reads only after it has sent its trace gets the sound
/// of every shorter trace.
constexpr size_t kMostWaitingBytes = size_t{64} << 20U;

/// Reads a trace, renders it, and sends one message after the other. A message is rendered when the
/// previous one has been sent, so a client that reads slowly occupies neither a thread nor memory.
class RenderCall final : public ExchangeCall<v1::RenderRequest, v1::RenderResponse>,
                         public IdleCall {
 public:
  RenderCall(const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places)
      : ExchangeCall(context, daemon.pool),
        places_(std::move(places)),
        idle_calls_(daemon.idle_calls),
        wait_(daemon.clock),
        reader_(daemon.database, daemon.heads, daemon.bodies) {
    idle_calls_.Add(*this);
    StartReading();
  }
  ~RenderCall() override { idle_calls_.Remove(*this); }

  void EndIfIdle(std::chrono::nanoseconds limit) override {
    if (!wait_.EndIfLonger(limit)) return;
    // A call cannot be finished while a message is being sent.
    if (writes_) return context().TryCancel();
    End(Refusal(absl::StatusCode::kDeadlineExceeded, "CLIENT_IDLE",
                absl::StrCat("nothing was sent for ", std::chrono::duration<double>(limit).count(),
                             " s: send the trace without pauses")));
  }

 private:
  absl::Status Take(const v1::RenderRequest& request) override {
    RETURN_IF_ERROR(reader_.Take(request));
    if (reader_.renderer() == nullptr) return absl::OkStatus();
    const ForwardRenderer& forward = reader_.renderer()->forward();
    renders_ = forward.waiting_bytes() > kMostWaitingBytes;
    return places_.memory.Grow(forward.object_bytes() >> 20U);
  }

  absl::Status AllRead() override {
    renders_ = true;
    return reader_.Finish();
  }

  void Await(bool writes) override {
    writes_ = writes;
    wait_.Begin();
  }

  bool Resume() override { return wait_.Resume(); }

  absl::StatusOr<Supply> Fill(v1::RenderResponse& response) override {
    if (response.has_summary()) return Supply::kEnd;
    if (!renders_) return Supply::kLater;
    if (!loudness_) {
      FillFormat(*response.mutable_format());
    } else if (FillBlock(*response.mutable_block())) {
    } else if (TakeBlows()) {
      FillBlows(*response.mutable_blows());
    } else if (!reader_.renderer()->forward().finished()) {
      renders_ = false;
      return Supply::kLater;
    } else {
      FillSummary(*response.mutable_summary());
    }
    return Supply::kMessage;
  }

  void FillFormat(v1::AudioFormat& format) {
    samples_.resize(kFramesPerMessage * reader_.channel_count());
    loudness_.emplace(reader_.sample_rate_hz(), reader_.channel_count());
    format.set_sample_rate_hz(reader_.sample_rate_hz());
    format.set_channel_count(reader_.channel_count());
  }

  /// Returns false if no frame is left that can no longer change.
  bool FillBlock(v1::AudioBlock& block) {
    const size_t count = reader_.renderer()->Render(samples_);
    if (count == 0) return false;
    const std::span<const float> samples =
        std::span(samples_).first(count * reader_.channel_count());
    loudness_->Add(samples);
    block.set_first_frame(frame_count_);
    block.set_samples(ToBytes(samples));
    frame_count_ += count;
    return true;
  }

  /// Returns whether there are blows that were not told yet.
  bool TakeBlows() {
    if (told_blow_count_ < blows_.size()) return true;
    told_blow_count_ = 0;
    blows_ = reader_.renderer()->forward().TakeBlows();
    return !blows_.empty();
  }

  void FillBlows(v1::RenderedBlows& message) {
    message.clear_blows();
    const size_t end = std::min(told_blow_count_ + kBlowsPerMessage, blows_.size());
    for (; told_blow_count_ < end; ++told_blow_count_) {
      *message.add_blows() = ToProto(blows_[told_blow_count_]);
    }
  }

  void FillSummary(v1::RenderSummary& summary) {
    const OfflineSummary rendered = reader_.renderer()->summary();
    summary.set_frame_count(rendered.frame_count);
    summary.set_accepted_count(rendered.accepted_count);
    summary.set_rejected_count(rendered.rejected_count);
    if (!rendered.last_rejection.ok()) {
      *summary.mutable_last_rejection() = ToLegibleErrorInfo(rendered.last_rejection);
    }
    *summary.mutable_findings() = ToProto(rendered.findings);
    summary.set_paper_coupling_object_count(rendered.paper_coupling_object_count);
    summary.set_peak(rendered.peak);
    AddWarnings(rendered.findings, summary);
    summary.set_limited_frame_count(rendered.limited_frame_count);
    summary.set_full_scale_pa(reader_.full_scale_pa());
    summary.set_peak_pa(rendered.peak * reader_.full_scale_pa());
    summary.set_true_peak(loudness_->true_peak());
    if (const auto lufs = loudness_->integrated()) summary.set_integrated_lufs(*lufs);
    if (const auto lufs = loudness_->loudest_momentary()) {
      summary.set_loudest_momentary_lufs(*lufs);
    }
  }

  RenderPlaces places_;
  IdleCalls& idle_calls_;
  ClientWait wait_;
  std::atomic<bool> writes_{false};
  TraceReader reader_;
  bool renders_ = false;                   // whether to render before the next request is read
  std::optional<LoudnessMeter> loudness_;  // set once the format was sent
  uint64_t frame_count_ = 0;
  std::vector<BlowRecord> blows_;
  size_t told_blow_count_ = 0;
  std::vector<float> samples_;
};

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::RenderResponse>* MakeRenderCall(
    const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places) {
  return new RenderCall(daemon, context, std::move(places));
}

}  // namespace carillon
