// SPDX-License-Identifier: Apache-2.0
//
// The calls for runs of decomposition jobs on other machines.
#include <grpcpp/client_context.h>

#include <chrono>
#include <fstream>
#include <utility>

#include "client_sdk/cpp/internal/authorize.h"
#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/model_file.h"
#include "client_sdk/cpp/internal/rpc_status.h"

namespace carillon::client {
namespace {

/// A run must not wait long for the report of its progress.
constexpr auto kReportTimeout = std::chrono::seconds(2);

}  // namespace

absl::Status GrpcClient::FetchMesh(const JobRun& run, const std::string& file) const {
  std::ofstream out(file, std::ios::binary);
  if (!out) return NotWritable(file);
  grpc::ClientContext context;
  Authorize(context, stubs_->server, run.token);
  v1::FetchMeshRequest request;
  request.set_job(run.job);
  const auto reader = stubs_->job_runs.FetchMesh(&context, request);
  v1::FetchMeshResponse response;
  while (out && reader->Read(&response)) out << response.data();
  out.close();
  if (!out) context.TryCancel();
  const absl::Status status = FromRpc(reader->Finish(), stubs_->server);
  return out ? status : NotWritable(file);
}

absl::Status GrpcClient::ReportProgress(const JobRun& run, const v1::Progress& progress) const {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kReportTimeout);
  Authorize(context, stubs_->server, run.token);
  v1::ReportProgressRequest request;
  request.set_job(run.job);
  *request.mutable_progress() = progress;
  v1::ReportProgressResponse response;
  return FromRpc(stubs_->job_runs.ReportProgress(&context, request, &response), stubs_->server);
}

absl::Status GrpcClient::UploadResult(const JobRun& run, const v1::RunEnd& end,
                                      const std::string& model_file) const {
  grpc::ClientContext context;
  Authorize(context, stubs_->server, run.token);
  v1::UploadResultResponse response;
  const auto writer = stubs_->job_runs.UploadResult(&context, &response);
  v1::UploadResultRequest request;
  request.set_job(run.job);
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
  const absl::Status status = FromRpc(writer->Finish(), stubs_->server);
  return open && !sent.ok() ? sent : status;
}

}  // namespace carillon::client
