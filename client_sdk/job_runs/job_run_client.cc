// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/job_runs/job_run_client.h"

#include <grpcpp/client_context.h>

#include <chrono>
#include <fstream>
#include <utility>

#include "carillon/worker/v1/job_run_service.grpc.pb.h"
#include "client_sdk/cpp/internal/authorize.h"
#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/model_file.h"
#include "client_sdk/cpp/internal/rpc_status.h"

namespace carillon::client {
namespace {

/// A run must not wait long for the report of its progress.
constexpr auto kReportTimeout = std::chrono::seconds(2);

}  // namespace

struct JobRunClient::Connection {
  std::string server;
  JobRun run;
  worker::v1::JobRunService::Stub stub;
};

JobRunClient::JobRunClient(const std::string& server, const ConnectOptions& options, JobRun run)
    : connection_(
          new Connection{.server = server,
                         .run = std::move(run),
                         .stub = worker::v1::JobRunService::Stub(OpenChannel(server, options))}) {}

JobRunClient::~JobRunClient() = default;

absl::Status JobRunClient::FetchMesh(const std::string& file) const {
  std::ofstream out(file, std::ios::binary);
  if (!out) return NotWritable(file);
  grpc::ClientContext context;
  Authorize(context, connection_->server, connection_->run.token);
  worker::v1::FetchMeshRequest request;
  request.set_job(connection_->run.job);
  const auto reader = connection_->stub.FetchMesh(&context, request);
  worker::v1::FetchMeshResponse response;
  while (out && reader->Read(&response)) out << response.data();
  out.close();
  if (!out) context.TryCancel();
  const absl::Status status = FromRpc(reader->Finish(), connection_->server);
  return out ? status : NotWritable(file);
}

absl::Status JobRunClient::ReportProgress(const v1::Progress& progress) const {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kReportTimeout);
  Authorize(context, connection_->server, connection_->run.token);
  worker::v1::ReportProgressRequest request;
  request.set_job(connection_->run.job);
  *request.mutable_progress() = progress;
  worker::v1::ReportProgressResponse response;
  return FromRpc(connection_->stub.ReportProgress(&context, request, &response),
                 connection_->server);
}

absl::Status JobRunClient::UploadResult(const worker::v1::RunEnd& end,
                                        const std::string& model_file) const {
  grpc::ClientContext context;
  Authorize(context, connection_->server, connection_->run.token);
  worker::v1::UploadResultResponse response;
  const auto writer = connection_->stub.UploadResult(&context, &response);
  worker::v1::UploadResultRequest request;
  request.set_job(connection_->run.job);
  bool open = true;
  absl::Status sent;
  const auto send = [&] {
    open = writer->Write(request);
    request.clear_job();
    return open ? absl::OkStatus() : absl::CancelledError();  // Finish tells why
  };
  if (HoldsTransfer(model_file)) {
    sent = ReadTransferRecords(model_file, [&](const v1::TransferRecord& record) {
      *request.mutable_transfer() = record;
      return send();
    });
  } else if (!model_file.empty()) {
    sent = ReadRecords(model_file, [&](const v1::ModalModelRecord& record) {
      *request.mutable_record() = record;
      return send();
    });
  }
  *request.mutable_end() = end;
  if (sent.ok()) writer->Write(request);
  if (open && !sent.ok()) context.TryCancel();
  writer->WritesDone();
  const absl::Status status = FromRpc(writer->Finish(), connection_->server);
  return open && !sent.ok() ? sent : status;
}

}  // namespace carillon::client
