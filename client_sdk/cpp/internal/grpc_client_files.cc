// SPDX-License-Identifier: Apache-2.0
//
// The calls that transfer models and files.
#include <grpcpp/client_context.h>

#include <algorithm>
#include <utility>

#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "client_sdk/cpp/internal/whole_file.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
absl::Status GrpcClient::ExportModalModel(const std::string& name, const RecordSink& sink) const {
  grpc::ClientContext context;
  Prepare(context);
  v1::ExportModalModelRequest request;
  request.set_name(name);
  request.set_transfers(true);
  const auto reader = stubs_->models.ExportModalModel(&context, request);
  v1::ExportModalModelResponse response;
  absl::Status taken = absl::OkStatus();
  while (taken.ok() && reader->Read(&response)) taken = sink(response.record());
  if (!taken.ok()) context.TryCancel();
  absl::Status status = FromRpc(reader->Finish(), stubs_->server);
  return taken.ok() ? status : taken;
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
  v1::BackUpDatabaseResponse response;
  uint64_t byte_count = 0;
  uint64_t received = 0;
  absl::Status written = absl::OkStatus();
  while (written.ok() && reader->Read(&response)) {
    byte_count = std::max(byte_count, response.byte_count());
    received += response.data().size();
    written = copy.Write(response.data());
  }
  if (!written.ok()) context.TryCancel();
  const absl::Status status = FromRpc(reader->Finish(), stubs_->server);
  RETURN_IF_ERROR(written);
  RETURN_IF_ERROR(status);
  if (received == 0 || received != byte_count) {
    return absl::DataLossError("the daemon ended before the whole copy was sent");
  }
  return copy.Publish();
}

}  // namespace carillon::client
