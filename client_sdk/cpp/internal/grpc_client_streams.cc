// SPDX-License-Identifier: Apache-2.0
//
// The calls that upload a mesh, follow a job, and transfer sound.
#include <grpcpp/client_context.h>

#include <bit>
#include <cstring>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

/// The largest piece of a mesh that the contract allows in one message.
constexpr size_t kUploadPieceBytes = 1 << 20;

static_assert(std::endian::native == std::endian::little, "samples come in little endian");

/// Converts the messages of a stream to blocks. A block is valid until the next call of Read().
class BlockReader {
 public:
  void SetFormat(const v1::AudioFormat& format) {
    block_.sample_rate_hz = format.sample_rate_hz();
    block_.channel_count = format.channel_count();
    encoding_ = format.encoding();
  }

  const AudioBlock& Read(const v1::AudioBlock& message, uint64_t lost_frame_count) {
    if (encoding_ == v1::AUDIO_ENCODING_INT16) {
      ReadIntegers(message.samples());
    } else {
      samples_.resize(message.samples().size() / sizeof(float));
      std::memcpy(samples_.data(), message.samples().data(), samples_.size() * sizeof(float));
    }
    block_.first_frame = message.first_frame();
    block_.lost_frame_count = lost_frame_count;
    block_.samples = samples_;
    return block_;
  }

 private:
  void ReadIntegers(const std::string& bytes) {
    constexpr float kFullScale = 32767;
    std::vector<int16_t> integers(bytes.size() / sizeof(int16_t));
    std::memcpy(integers.data(), bytes.data(), integers.size() * sizeof(int16_t));
    samples_.assign(integers.begin(), integers.end());
    for (float& sample : samples_) sample /= kFullScale;
  }

  std::vector<float> samples_;
  v1::AudioEncoding encoding_ = v1::AUDIO_ENCODING_UNSPECIFIED;
  AudioBlock block_;
};

/// Errors: InvalidArgument (INVALID_SETTINGS: the callback is empty).
template <class Callback>
absl::Status CheckCallback(const Callback& callback, absl::string_view name) {
  if (callback) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat(name, " is empty; give a function that takes what the daemon sends"));
}

using RenderCall = grpc::ClientReaderWriter<v1::RenderRequest, v1::RenderResponse>;

/// Sends the settings and the trace. An error of the trace cancels the call.
absl::Status SendTrace(const v1::RenderSettings& settings, ContactTraceReader& trace,
                       grpc::ClientContext& context, RenderCall& call) {
  v1::RenderRequest request;
  *request.mutable_settings() = settings;
  bool sent = call.Write(request);
  *request.mutable_record()->mutable_header() = trace.header();
  sent = sent && call.Write(request);
  for (bool first = true; sent; first = false) {
    absl::StatusOr<std::optional<v1::ContactTraceRecord>> record = trace.Next();
    if (record.ok() && !*record && first) record = trace.NothingLeft();
    if (!record.ok()) {
      context.TryCancel();
      return record.status();
    }
    if (!*record) break;
    *request.mutable_record() = std::move(**record);
    sent = call.Write(request);
  }
  call.WritesDone();
  return absl::OkStatus();
}

struct Rendering {
  std::optional<v1::RenderSummary> summary;
  bool stopped = false;
};

using BlowCallback = std::function<void(const v1::Blow&)>;

Rendering ReceiveSound(const AudioCallback& on_block, const BlowCallback& on_blow,
                       grpc::ClientContext& context, RenderCall& call) {
  Rendering rendering;
  BlockReader reader;
  v1::RenderResponse response;
  while (call.Read(&response)) {
    if (response.has_format()) reader.SetFormat(response.format());
    if (response.has_summary()) rendering.summary = response.summary();
    for (const v1::Blow& blow : response.blows().blows()) {
      if (on_blow) on_blow(blow);
    }
    if (response.has_block() && !rendering.stopped && !on_block(reader.Read(response.block(), 0))) {
      rendering.stopped = true;
      context.TryCancel();
    }
  }
  return rendering;
}

}  // namespace

absl::StatusOr<std::string> GrpcClient::UploadMesh(absl::string_view bytes) const {
  grpc::ClientContext context;
  Prepare(context);
  v1::UploadMeshResponse response;
  const auto writer = stubs_->models.UploadMesh(&context, &response);
  v1::UploadMeshRequest request;
  for (size_t sent = 0; sent < bytes.size(); sent += kUploadPieceBytes) {
    request.set_data(std::string(bytes.substr(sent, kUploadPieceBytes)));
    if (!writer->Write(request)) break;  // Finish tells why
  }
  writer->WritesDone();
  RETURN_IF_ERROR(FromRpc(writer->Finish(), stubs_->server));
  return response.mesh_digest();
}

absl::StatusOr<v1::Job> GrpcClient::WatchJob(
    const std::string& name, const std::function<void(const v1::Job&)>& on_change) const {
  grpc::ClientContext context;
  Prepare(context);
  v1::WatchJobRequest request;
  request.set_name(name);
  const auto reader = stubs_->decompositions.WatchJob(&context, request);
  v1::WatchJobResponse response;
  while (reader->Read(&response)) {
    if (on_change) on_change(response.job());
  }
  RETURN_IF_ERROR(FromRpc(reader->Finish(), stubs_->server));
  const v1::Job& job = response.job();
  if (job.state() == v1::JOB_STATE_FAILED) {
    return FromErrorInfo(absl::StatusCode::kFailedPrecondition, job.error());
  }
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    return Refusal(absl::StatusCode::kCancelled, "JOB_CANCELLED",
                   "the decomposition was cancelled; create the model again");
  }
  return job;
}

absl::Status GrpcClient::WatchJobs(
    const v1::WatchJobsRequest& request,
    const std::function<bool(const v1::WatchJobsResponse&)>& on_answer) const {
  RETURN_IF_ERROR(CheckCallback(on_answer, "on_answer"));
  grpc::ClientContext context;
  Prepare(context);
  const auto reader = stubs_->decompositions.WatchJobs(&context, request);
  v1::WatchJobsResponse answer;
  bool stopped = false;
  while (!stopped && reader->Read(&answer)) stopped = !on_answer(answer);
  if (stopped) context.TryCancel();
  const grpc::Status status = reader->Finish();
  return stopped ? absl::OkStatus() : FromRpc(status, stubs_->server);
}

absl::Status GrpcClient::RecordContacts(
    const std::string& scene, const std::function<void()>& on_begun,
    const std::function<bool(const v1::ContactTraceRecord&)>& on_record) const {
  RETURN_IF_ERROR(CheckCallback(on_record, "on_record"));
  grpc::ClientContext context;
  Prepare(context);
  v1::RecordContactsRequest request;
  request.set_scene(scene);
  const auto stream = stubs_->contacts.RecordContacts(&context, request);
  v1::RecordContactsResponse response;
  bool stopped = false;
  while (!stopped && stream->Read(&response)) {
    if (response.has_record()) {
      stopped = !on_record(response.record());
    } else if (on_begun) {
      on_begun();
    }
  }
  if (stopped) context.TryCancel();
  const grpc::Status status = stream->Finish();
  return stopped ? absl::OkStatus() : FromRpc(status, stubs_->server);
}

absl::Status GrpcClient::Listen(const v1::ListenRequest& request,
                                const AudioCallback& on_block) const {
  RETURN_IF_ERROR(CheckCallback(on_block, "on_block"));
  grpc::ClientContext context;
  Prepare(context);
  const auto stream = stubs_->audio.Listen(&context, request);
  BlockReader reader;
  v1::ListenResponse response;
  bool stopped = false;
  while (!stopped && stream->Read(&response)) {
    if (response.has_format()) reader.SetFormat(response.format());
    if (!response.has_block()) continue;
    stopped = !on_block(reader.Read(response.block(), response.lost_frame_count()));
  }
  if (stopped) context.TryCancel();
  const grpc::Status status = stream->Finish();
  return stopped ? absl::OkStatus() : FromRpc(status, stubs_->server);
}

absl::StatusOr<v1::RenderSummary> GrpcClient::Render(const v1::RenderSettings& settings,
                                                     ContactTraceReader& trace,
                                                     const AudioCallback& on_block,
                                                     const BlowCallback& on_blow) const {
  RETURN_IF_ERROR(CheckCallback(on_block, "on_block"));
  grpc::ClientContext context;
  Prepare(context);
  const auto call = stubs_->audio.Render(&context);
  // A second thread sends, because the daemon may send sound before it has the whole trace.
  absl::Status sent;
  std::jthread sender([&] { sent = SendTrace(settings, trace, context, *call); });
  const Rendering rendering = ReceiveSound(on_block, on_blow, context, *call);
  sender.join();
  const grpc::Status status = call->Finish();
  if (!sent.ok()) return sent;
  if (rendering.stopped) {
    return Refusal(absl::StatusCode::kCancelled, "RENDERING_STOPPED",
                   "the callback that receives the sound has stopped the rendering");
  }
  if (!status.ok()) return FromRpc(status, stubs_->server);
  if (!rendering.summary) return absl::DataLossError("the daemon ended without a summary");
  return *rendering.summary;
}

}  // namespace carillon::client
