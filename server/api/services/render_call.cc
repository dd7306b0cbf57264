// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/render_call.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/status_conversion.h"
#include "server/api/call/stream_call.h"
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

/// Reads the whole trace, then renders and sends one message after the other. A message is rendered
/// when the previous one has been sent, so a client that reads slowly occupies neither a thread nor
/// memory.
class RenderCall final : public BidiStream<v1::RenderRequest, v1::RenderResponse>, public IdleCall {
 public:
  RenderCall(const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places)
      : StreamWriter(&daemon.pool),
        places_(std::move(places)),
        context_(context),
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
    if (writes_) return context_.TryCancel();
    End(Refusal(absl::StatusCode::kDeadlineExceeded, "CLIENT_IDLE",
                absl::StrCat("nothing was sent for ", std::chrono::duration<double>(limit).count(),
                             " s: send the trace without pauses")));
  }

 private:
  absl::Status Take(const v1::RenderRequest& request) override {
    RETURN_IF_ERROR(reader_.Take(request));
    RETURN_IF_ERROR(GrowMemory(reader_.held_bytes() >> 20U));
    wait_.Begin();
    return absl::OkStatus();
  }

  absl::Status GrowMemory(size_t mib) {
    if (mib <= places_.memory.most()) return places_.memory.Grow(mib);
    return Refusal(absl::StatusCode::kResourceExhausted, "TRACE_TOO_LARGE",
                   absl::StrCat("the trace takes over ", places_.memory.most(),
                                " MiB, the most that the daemon has for the renderings of one "
                                "client: render it in pieces"));
  }

  bool GoesOn() override { return wait_.Resume(); }

  bool gone() const override { return context_.IsCancelled(); }

  void AllRead() override {
    writes_ = true;
    absl::StatusOr<std::unique_ptr<OfflineRenderer>> renderer = reader_.Finish();
    if (!renderer.ok()) return End(renderer.status());
    renderer_ = *std::move(renderer);
    loudness_.emplace(reader_.sample_rate_hz(), reader_.channel_count());
    StartWriting();
  }

  absl::StatusOr<Supply> Fill(v1::RenderResponse& response) override {
    if (!wait_.Resume()) return absl::CancelledError("the client has not read for too long");
    absl::StatusOr<Supply> supply = FillNext(response);
    wait_.Begin();
    return supply;
  }

  absl::StatusOr<Supply> FillNext(v1::RenderResponse& response) {
    if (response.has_summary()) return Supply::kEnd;
    if (samples_.empty()) {
      samples_.resize(kFramesPerMessage * reader_.channel_count());
      response.mutable_format()->set_sample_rate_hz(reader_.sample_rate_hz());
      response.mutable_format()->set_channel_count(reader_.channel_count());
      return Supply::kMessage;
    }
    const uint64_t first_frame = renderer_->summary().frame_count;
    const size_t count = renderer_->Render(samples_);
    if (count > 0) {
      const std::span<const float> block =
          std::span(samples_).first(count * reader_.channel_count());
      loudness_->Add(block);
      response.mutable_block()->set_first_frame(first_frame);
      response.mutable_block()->set_samples(ToBytes(block));
    } else if (told_blow_count_ < renderer_->blows().size()) {
      FillBlows(*response.mutable_blows());
    } else {
      FillSummary(*response.mutable_summary());
    }
    return Supply::kMessage;
  }

  void FillBlows(v1::RenderedBlows& message) {
    constexpr size_t kBlowsPerMessage = 1000;
    message.clear_blows();
    const std::vector<BlowRecord>& blows = renderer_->blows();
    const size_t end = std::min(told_blow_count_ + kBlowsPerMessage, blows.size());
    for (; told_blow_count_ < end; ++told_blow_count_) {
      *message.add_blows() = ToProto(blows[told_blow_count_]);
    }
  }

  void FillSummary(v1::RenderSummary& summary) const {
    const OfflineSummary& rendered = renderer_->summary();
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
  grpc::CallbackServerContext& context_;
  IdleCalls& idle_calls_;
  ClientWait wait_;
  std::atomic<bool> writes_{false};
  TraceReader reader_;
  std::unique_ptr<OfflineRenderer> renderer_;
  std::optional<LoudnessMeter> loudness_;
  size_t told_blow_count_ = 0;
  std::vector<float> samples_;
};

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::RenderResponse>* MakeRenderCall(
    const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places) {
  return new RenderCall(daemon, context, std::move(places));
}

}  // namespace carillon
