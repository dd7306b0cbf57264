// SPDX-License-Identifier: Apache-2.0
#include "server/api/render_call.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/sample_bytes.h"
#include "server/api/status_conversion.h"
#include "server/api/trace_reader.h"

namespace carillon {
namespace {

constexpr int kMaxCallCount = 8;
/// 64 blocks, 32 KiB: few messages, and the pool is soon free for the next call.
constexpr size_t kFramesPerMessage = 64 * OfflineRenderer::kBlockFrameCount;

/// Reads the whole trace, then renders and sends one message after the other: a piece is rendered
/// when the last has been sent, so that a slow reader holds neither a thread nor memory. Every deed
/// follows from the one before, so no two threads are in here at a time.
class RenderCall final : public grpc::ServerBidiReactor<v1::RenderRequest, v1::RenderResponse> {
 public:
  explicit RenderCall(const RenderContext& daemon)
      : daemon_(daemon), reader_(daemon.models, daemon.bodies) {
    if (++daemon_.call_count > kMaxCallCount) {
      Finish(ToGrpcStatus(Refusal(
          absl::StatusCode::kResourceExhausted, "TOO_MANY_RENDERINGS",
          absl::StrCat(kMaxCallCount, " traces are being rendered; try again when one is done"))));
    } else {
      StartRead(&request_);
    }
  }
  ~RenderCall() override { --daemon_.call_count; }

  void OnReadDone(bool ok) override {
    daemon_.pool.Run([this, ok] { ok ? Take() : Begin(); });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    if (response_.has_summary()) return Finish(grpc::Status::OK);
    daemon_.pool.Run([this] { SendNext(); });
  }

  void OnDone() override { delete this; }

 private:
  void Take() {
    if (absl::Status status = reader_.Take(request_); !status.ok()) {
      return Finish(ToGrpcStatus(status));
    }
    StartRead(&request_);
  }

  void Begin() {
    absl::StatusOr<std::unique_ptr<OfflineRenderer>> renderer = reader_.Finish();
    if (!renderer.ok()) return Finish(ToGrpcStatus(renderer.status()));
    renderer_ = *std::move(renderer);
    samples_.resize(kFramesPerMessage * reader_.channel_count());
    response_.mutable_format()->set_sample_rate_hz(reader_.sample_rate_hz());
    response_.mutable_format()->set_channel_count(reader_.channel_count());
    StartWrite(&response_);
  }

  void SendNext() {
    const uint64_t first_frame = renderer_->summary().frame_count;
    const size_t count = renderer_->Render(samples_);
    if (count > 0) {
      response_.mutable_block()->set_first_frame(first_frame);
      response_.mutable_block()->set_samples(
          ToBytes(std::span(samples_).first(count * reader_.channel_count())));
    } else {
      FillSummary(*response_.mutable_summary());
    }
    StartWrite(&response_);
  }

  void FillSummary(v1::RenderSummary& summary) const {
    const OfflineSummary& rendered = renderer_->summary();
    summary.set_frame_count(rendered.frame_count);
    summary.set_accepted_count(rendered.accepted_count);
    summary.set_rejected_count(rendered.rejected_count);
    summary.set_peak(rendered.peak);
    summary.set_limited_frame_count(rendered.limited_frame_count);
  }

  const RenderContext daemon_;
  TraceReader reader_;
  std::unique_ptr<OfflineRenderer> renderer_;
  std::vector<float> samples_;
  v1::RenderRequest request_;
  v1::RenderResponse response_;
};

}  // namespace

grpc::ServerBidiReactor<v1::RenderRequest, v1::RenderResponse>* MakeRenderCall(
    const RenderContext& daemon) {
  return new RenderCall(daemon);
}

}  // namespace carillon
