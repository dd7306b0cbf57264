// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/grpc_client.h"

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cpp/internal/block_reader.h"
#include "client_sdk/cpp/internal/contact_stream_call.h"
#include "client_sdk/cpp/internal/performance_call.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "client_sdk/cpp/internal/whole_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

/// Whether the text can be sent as metadata: printable ASCII.
bool IsSendable(const std::string& token) {
  return std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
}

/// Adds the token to a call of the daemon at `server`. Adds nothing if the token is empty or is not
/// sendable. gRPC ends the call, before the token is sent, if another machine could read it: if the
/// connection has no TLS and leaves this machine (FromRpc, TLS_REQUIRED).
void Authorize(grpc::ClientContext& context, const std::string& server, const std::string& token) {
  if (token.empty() || !IsSendable(token)) return;
  if (IsOnThisMachine(server)) {
    context.AddMetadata("authorization", "Bearer " + token);
  } else {
    context.set_credentials(grpc::AccessTokenCredentials(token));
  }
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const ConnectOptions& options) {
  if (options.tls_roots_pem.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = options.tls_roots_pem;
  ssl.pem_cert_chain = options.tls_certificate_pem;
  ssl.pem_private_key = options.tls_key_pem;
  return grpc::SslCredentials(ssl);
}

std::string TokenOf(const ConnectOptions& options) {
  if (!options.token.empty()) return options.token;
  const char* token = std::getenv("CARILLON_TOKEN");
  return token == nullptr ? "" : token;
}

/// Any message, by which a stub sends and receives those of all calls.
using Message = google::protobuf::Message;

/// The largest piece of a mesh that the contract allows in one message.
constexpr size_t kUploadPieceBytes = 1 << 20;

// HealthCheckRequest has the bytes of a StringValue, and HealthCheckResponse those of an
// Int32Value. Its code generated from health.proto would be one more file that users need.
using HealthRequest = google::protobuf::StringValue;
using HealthResponse = google::protobuf::Int32Value;

constexpr char kCheck[] = "/grpc.health.v1.Health/Check";
/// HealthCheckResponse.ServingStatus.SERVING
constexpr int kServing = 1;

/// Gives each answer of a stream to `take` until that returns false, which cancels the call.
template <class Answer, class Reader, class Take>
absl::Status TakeEach(Reader& reader, grpc::ClientContext& context, const std::string& server,
                      Take take) {
  Answer answer;
  bool stopped = false;
  while (!stopped && reader.Read(&answer)) stopped = !take(answer);
  if (stopped) context.TryCancel();
  const grpc::Status status = reader.Finish();
  return stopped ? absl::OkStatus() : FromRpc(status, server);
}

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

std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server, const ConnectOptions& options,
                                           bool alone) {
  grpc::ChannelArguments arguments;
  if (alone) arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  if (IsOnThisMachine(server)) {
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
    // A daemon that was started again is found at once; looking for it costs nothing here.
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 500);
  }
  return grpc::CreateCustomChannel(server, CredentialsFor(options), arguments);
}

GrpcClient::GrpcClient(const std::string& server, const ConnectOptions& options)
    : stubs_(std::make_shared<Stubs>(server, TokenOf(options), OpenChannel(server, options))) {}

std::unique_ptr<Client> GrpcClient::WithTimeout(std::chrono::milliseconds timeout) const {
  return std::unique_ptr<Client>(new GrpcClient(stubs_, timeout));
}

void GrpcClient::Prepare(grpc::ClientContext& context,
                         std::optional<std::chrono::milliseconds> usual) const {
  Authorize(context, stubs_->server, stubs_->token);
  const auto timeout = timeout_ ? timeout_ : usual;
  if (timeout) context.set_deadline(std::chrono::system_clock::now() + *timeout);
}

absl::Status GrpcClient::Call(absl::string_view method, const Message& request,
                              Message& response) const {
  grpc::ClientContext context;
  Prepare(context, kCallTimeout);
  return CallByPath(absl::StrCat("/carillon.v1.", method), request, response, context);
}

absl::Status GrpcClient::CallByPath(const std::string& path, const Message& request,
                                    Message& response, grpc::ClientContext& context) const {
  grpc::CompletionQueue queue;
  grpc::TemplatedGenericStub<Message, Message> stub(stubs_->channel);
  const auto call = stub.PrepareUnaryCall(&context, path, request, &queue);
  call->StartCall();
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return FromRpc(status, stubs_->server);
}

absl::StatusOr<std::unique_ptr<ContactStream>> GrpcClient::StreamContacts(
    const v1::ContactStreamStart& start) const {
  auto context = std::make_unique<grpc::ClientContext>();
  Prepare(*context);
  return OpenContactStream(stubs_->contacts, stubs_->server, std::move(context), start);
}

absl::StatusOr<std::unique_ptr<Performance>> GrpcClient::Perform(
    const v1::PerformSettings& settings) const {
  auto context = std::make_unique<grpc::ClientContext>();
  Prepare(*context);
  return OpenPerformance(stubs_->audio, stubs_->server, std::move(context), settings);
}

absl::StatusOr<bool> GrpcClient::IsServing(const std::string& service) const {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout_.value_or(kHealthTimeout));
  HealthRequest request;
  request.set_value(service);
  HealthResponse response;
  RETURN_IF_ERROR(CallByPath(kCheck, request, response, context));
  return response.value() == kServing;
}

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
  return TakeEach<v1::WatchJobsResponse>(*reader, context, stubs_->server, on_answer);
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
  const auto take = [&](const v1::RecordContactsResponse& response) {
    if (response.has_record()) return on_record(response.record());
    if (on_begun) on_begun();
    return true;
  };
  return TakeEach<v1::RecordContactsResponse>(*stream, context, stubs_->server, take);
}

absl::Status GrpcClient::Listen(const v1::ListenRequest& request,
                                const AudioCallback& on_block) const {
  RETURN_IF_ERROR(CheckCallback(on_block, "on_block"));
  grpc::ClientContext context;
  Prepare(context);
  const auto stream = stubs_->audio.Listen(&context, request);
  BlockReader reader;
  const auto take = [&](const v1::ListenResponse& response) {
    if (response.has_format()) reader.SetFormat(response.format());
    return !response.has_block() ||
           on_block(reader.Read(response.block(), response.lost_frame_count()));
  };
  return TakeEach<v1::ListenResponse>(*stream, context, stubs_->server, take);
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

absl::Status GrpcClient::ExportModalModel(const std::string& name, const RecordSink& sink) const {
  grpc::ClientContext context;
  Prepare(context);
  v1::ExportModalModelRequest request;
  request.set_name(name);
  request.set_transfers(true);
  const auto reader = stubs_->models.ExportModalModel(&context, request);
  absl::Status taken = absl::OkStatus();
  RETURN_IF_ERROR(TakeEach<v1::ExportModalModelResponse>(*reader, context, stubs_->server,
                                                         [&](const auto& response) {
                                                           taken = sink(response.record());
                                                           return taken.ok();
                                                         }));
  return taken;
}

absl::StatusOr<v1::ModalModelSummary> GrpcClient::ImportModalModel(
    const std::function<absl::Status(const RecordSink&)>& send, const std::string& name,
    const std::string& label) const {
  grpc::ClientContext context;
  Prepare(context);
  v1::ImportModalModelResponse response;
  const auto writer = stubs_->models.ImportModalModel(&context, &response);
  v1::ImportModalModelRequest request;
  request.set_name(name);
  request.set_label(label);
  bool open = true;
  absl::Status sent = send([&](const v1::ModalModelRecord& record) {
    *request.mutable_record() = record;
    open = writer->Write(request);
    request.clear_name();
    request.clear_label();
    return open ? absl::OkStatus() : absl::CancelledError();  // Finish tells why
  });
  if (open && !sent.ok()) context.TryCancel();
  writer->WritesDone();
  const absl::Status status = FromRpc(writer->Finish(), stubs_->server);
  if (open && !sent.ok()) return sent;
  if (!status.ok()) return status;
  return std::move(*response.mutable_modal_model());
}

absl::Status GrpcClient::BackUpDatabase(const std::string& file) const {
  ASSIGN_OR_RETURN(WholeFile copy, WholeFile::Create(file));
  grpc::ClientContext context;
  Prepare(context);
  const auto reader = stubs_->admin.BackUpDatabase(&context, {});
  uint64_t byte_count = 0;
  uint64_t received = 0;
  absl::Status written = absl::OkStatus();
  const auto take = [&](const v1::BackUpDatabaseResponse& response) {
    byte_count = std::max(byte_count, response.byte_count());
    received += response.data().size();
    written = copy.Write(response.data());
    return written.ok();
  };
  RETURN_IF_ERROR(TakeEach<v1::BackUpDatabaseResponse>(*reader, context, stubs_->server, take));
  RETURN_IF_ERROR(written);
  if (received == 0 || received != byte_count) {
    return absl::DataLossError("the daemon ended before the whole copy was sent");
  }
  return copy.Publish();
}

}  // namespace carillon::client
