// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/performance_call.h"

#include <cstring>
#include <utility>
#include <vector>

#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

class PerformanceCall final : public Performance {
 public:
  PerformanceCall(v1::AudioService::Stub& stub, std::string server,
                  std::unique_ptr<grpc::ClientContext> context)
      : server_(std::move(server)),
        context_(std::move(context)),
        call_(stub.Perform(context_.get())) {}

  ~PerformanceCall() override {
    if (ended_) return;
    context_->TryCancel();
    call_->Finish();
  }

  absl::Status Begin(const v1::PerformSettings& settings) {
    *request_.mutable_settings() = settings;
    if (!call_->Write(request_) || !call_->Read(&response_)) return End();
    begun_ = response_.begun();
    return absl::OkStatus();
  }

  const v1::PerformanceBegun& begun() const override { return begun_; }

  absl::StatusOr<PerformedStep> Step(const v1::PerformStep& step) override {
    *request_.mutable_step() = step;
    if (ended_ || !call_->Write(request_)) return End();
    samples_.clear();
    do {
      if (!call_->Read(&response_)) return End();
      Append(response_.samples().samples());
    } while (!response_.samples().is_last());
    response_.mutable_samples()->clear_samples();
    return PerformedStep{.samples = samples_,
                         .frame_count = response_.samples().frame_count(),
                         .findings = &response_.samples()};
  }

  absl::Status Reset(const v1::PerformReset& reset) override {
    *request_.mutable_reset() = reset;
    if (ended_ || !call_->Write(request_)) return End();
    return absl::OkStatus();
  }

 private:
  void Append(const std::string& bytes) {
    const size_t size = samples_.size();
    samples_.resize(size + bytes.size() / sizeof(float));
    std::memcpy(samples_.data() + size, bytes.data(), bytes.size());
  }

  /// Returns why the call has ended.
  absl::Status End() {
    if (!std::exchange(ended_, true)) {
      const grpc::Status status = call_->Finish();
      error_ = status.ok() ? absl::DataLossError("the daemon has ended the performance")
                           : FromRpc(status, server_);
    }
    return error_;
  }

  const std::string server_;
  const std::unique_ptr<grpc::ClientContext> context_;
  const std::unique_ptr<grpc::ClientReaderWriter<v1::PerformRequest, v1::PerformResponse>> call_;
  v1::PerformRequest request_;
  v1::PerformResponse response_;
  v1::PerformanceBegun begun_;
  std::vector<float> samples_;
  bool ended_ = false;
  absl::Status error_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Performance>> OpenPerformance(
    v1::AudioService::Stub& stub, const std::string& server,
    std::unique_ptr<grpc::ClientContext> context, const v1::PerformSettings& settings) {
  auto performance = std::make_unique<PerformanceCall>(stub, server, std::move(context));
  RETURN_IF_ERROR(performance->Begin(settings));
  return performance;
}

}  // namespace carillon::client
