// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/model_streams.h"

#include <deque>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/read_call.h"
#include "server/api/call/send_call.h"
#include "server/api/convert/resource_name.h"
#include "server/api/services/transfer_spool.h"
#include "server/mode_database/codec/imported_figures.h"
#include "server/mode_database/database.h"

namespace carillon {
namespace {

class MeshSink {
 public:
  explicit MeshSink(UploadTarget target)
      : meshes_(&target.meshes), log_event_(std::move(target.log_event)) {}

  absl::Status Append(const v1::UploadMeshRequest& request) {
    RETURN_IF_ERROR(Begin());
    return upload_->Append(request.data());
  }

  absl::Status Finish(v1::UploadMeshResponse& response) {
    RETURN_IF_ERROR(Begin());
    ASSIGN_OR_RETURN(const StoredMesh mesh, upload_->Finish());
    response.set_mesh_digest(mesh.digest);
    response.set_byte_count(mesh.byte_count);
    log_event_(Event("mesh_stored").With("mesh", mesh.digest).With("bytes", mesh.byte_count));
    return absl::OkStatus();
  }

 private:
  absl::Status Begin() {
    if (upload_) return absl::OkStatus();
    ASSIGN_OR_RETURN(upload_, meshes_->Begin());
    return absl::OkStatus();
  }

  MeshStore* meshes_;
  EventSink log_event_;
  std::optional<MeshUpload> upload_;
};

class ModelSink {
 public:
  explicit ModelSink(ImportTarget target)
      : database_(&target.database),
        replacing_(target.replacing),
        log_event_(std::move(target.log_event)),
        transfers_(target.database.database()) {}

  absl::Status Append(const v1::ImportModalModelRequest& request) {
    RETURN_IF_ERROR(Begin(request));
    if (request.record().record_case() == v1::ModalModelRecord::kTransfer) {
      return transfers_.Append(request.record().transfer());
    }
    if (request.record().has_header()) {
      RETURN_IF_ERROR(CheckFigures(request.record().header()));
    }
    return import_->Append(request.record());
  }

  absl::Status Finish(v1::ImportModalModelResponse& response) {
    if (!import_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                     "no record was sent; send the header, then every chunk");
    }
    // All transfers are checked before anything is stored.
    RETURN_IF_ERROR(transfers_.ForEach(
        [](const StoredTransfer& transfer) { return CheckFigures(transfer.header()); }));
    ASSIGN_OR_RETURN(const ModelSummary summary, import_->Finish());
    if (!import_->kept()) {
      log_event_(Event("model_imported")
                     .With("model", ModelName(summary.digest))
                     .WithSome("label", summary.label)
                     .With("modes", summary.header.mode_count())
                     .With("bytes", summary.stored_bytes));
    }
    // A model that this call has stored takes any transfer.
    const Replacing replacing = import_->kept() ? replacing_ : Replacing::kAlways;
    RETURN_IF_ERROR(transfers_.ForEach([&](const StoredTransfer& transfer) {
      return database_->transfers().Put(summary.digest, transfer, replacing).status();
    }));
    *response.mutable_modal_model() = ToProto(summary);
    return absl::OkStatus();
  }

 private:
  absl::Status Begin(const v1::ImportModalModelRequest& first) {
    if (import_) return absl::OkStatus();
    absl::string_view digest = first.name();
    absl::ConsumePrefix(&digest, "modalModels/");
    ASSIGN_OR_RETURN(import_,
                     database_->models().Import(std::string(digest), first.label(), replacing_));
    return absl::OkStatus();
  }

  ModeDatabase* database_;
  Replacing replacing_;
  EventSink log_event_;
  std::optional<ModelImport> import_;
  TransferSpool transfers_;
};

/// Sends a model, then its transfers, record by record.
class ExportCall final : public SendCall<v1::ExportModalModelResponse> {
 public:
  ExportCall(grpc::CallbackServerContext& context, const v1::ExportModalModelRequest& request,
             ModeDatabase& database, ThreadPool& pool, CallBounds bounds)
      : SendCall(context, std::move(bounds), pool), request_(request), database_(database) {
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> FillNext(v1::ExportModalModelResponse& response) override {
    if (!export_) RETURN_IF_ERROR(Begin());
    ASSIGN_OR_RETURN(std::optional<v1::ModalModelRecord> record, export_->Next());
    if (record) {
      *response.mutable_record() = *std::move(record);
      return Supply::kMessage;
    }
    if (records_.empty() && !BeginTransfer()) return Supply::kEnd;
    response.mutable_record()->set_transfer(records_.front().SerializeAsString());
    records_.pop_front();
    return Supply::kMessage;
  }

  absl::Status Begin() {
    ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request_.name()));
    ASSIGN_OR_RETURN(export_, database_.models().Export(digest));
    if (!request_.transfers()) return absl::OkStatus();
    ASSIGN_OR_RETURN(std::vector<StoredTransfer> transfers, database_.transfers().Read(digest));
    transfers_.assign(std::make_move_iterator(transfers.begin()),
                      std::make_move_iterator(transfers.end()));
    return absl::OkStatus();
  }

  /// Makes the records of the next transfer. Returns false if there is none.
  bool BeginTransfer() {
    if (transfers_.empty()) return false;
    for (v1::TransferRecord& record : transfers_.front().Records()) {
      records_.push_back(std::move(record));
    }
    transfers_.pop_front();
    return true;
  }

  const v1::ExportModalModelRequest request_;
  ModeDatabase& database_;
  std::optional<ModelExport> export_;
  std::deque<StoredTransfer> transfers_;
  std::deque<v1::TransferRecord> records_;
};

}  // namespace

grpc::ServerReadReactor<grpc::ByteBuffer>* MakeUpload(grpc::CallbackServerContext& context,
                                                      v1::UploadMeshResponse& response,
                                                      UploadTarget target, ThreadPool& pool,
                                                      CallBounds bounds) {
  return new ReadCall<v1::UploadMeshRequest, v1::UploadMeshResponse, MeshSink>(
      context, response, MeshSink(std::move(target)), pool, std::move(bounds));
}

grpc::ServerReadReactor<grpc::ByteBuffer>* MakeImport(grpc::CallbackServerContext& context,
                                                      v1::ImportModalModelResponse& response,
                                                      ImportTarget target, ThreadPool& pool,
                                                      CallBounds bounds) {
  return new ReadCall<v1::ImportModalModelRequest, v1::ImportModalModelResponse, ModelSink>(
      context, response, ModelSink(std::move(target)), pool, std::move(bounds));
}

grpc::ServerWriteReactor<v1::ExportModalModelResponse>* MakeExport(
    grpc::CallbackServerContext& context, const v1::ExportModalModelRequest& request,
    ModeDatabase& database, ThreadPool& pool, CallBounds bounds) {
  return new ExportCall(context, request, database, pool, std::move(bounds));
}

v1::ModalModelSummary ToProto(const ModelSummary& summary) {
  v1::ModalModelSummary proto;
  proto.set_name(ModelName(summary.digest));
  proto.set_label(summary.label);
  *proto.mutable_header() = summary.header;
  proto.set_stored_bytes(summary.stored_bytes);
  proto.set_created_unix_ms(summary.created_unix_ms);
  proto.set_revision(summary.revision);
  proto.mutable_tags()->Assign(summary.tags.begin(), summary.tags.end());
  proto.set_pinned(summary.pinned);
  proto.set_sounded_unix_ms(summary.sounded_unix_ms);
  if (summary.material.has_value()) *proto.mutable_material() = *summary.material;
  return proto;
}

}  // namespace carillon
