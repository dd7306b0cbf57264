// SPDX-License-Identifier: Apache-2.0
#include "server/api/model_transfer.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "server/api/read_call.h"
#include "server/api/resource_name.h"
#include "server/api/status_conversion.h"

namespace carillon {
namespace {

class MeshSink {
 public:
  explicit MeshSink(MeshStore& meshes) : meshes_(&meshes) {}

  absl::Status Append(const v1::UploadMeshRequest& request) {
    if (absl::Status status = Begin(); !status.ok()) return status;
    return upload_->Append(request.data());
  }

  absl::Status Finish(v1::UploadMeshResponse& response) {
    if (absl::Status status = Begin(); !status.ok()) return status;
    const absl::StatusOr<StoredMesh> mesh = upload_->Finish();
    if (!mesh.ok()) return mesh.status();
    response.set_mesh_digest(mesh->digest);
    response.set_byte_count(mesh->byte_count);
    return absl::OkStatus();
  }

 private:
  absl::Status Begin() {
    if (upload_) return absl::OkStatus();
    absl::StatusOr<MeshUpload> upload = meshes_->Begin();
    if (!upload.ok()) return upload.status();
    upload_ = *std::move(upload);
    return absl::OkStatus();
  }

  MeshStore* meshes_;
  std::optional<MeshUpload> upload_;
};

class ModelSink {
 public:
  explicit ModelSink(ModelStore& models) : models_(&models) {}

  absl::Status Append(const v1::ImportModalModelRequest& request) {
    if (absl::Status status = Begin(request); !status.ok()) return status;
    return import_->Append(request.record());
  }

  absl::Status Finish(v1::ImportModalModelResponse& response) {
    if (!import_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                     "no record was sent; send the header, then every chunk");
    }
    const absl::StatusOr<ModelSummary> summary = import_->Finish();
    if (summary.ok()) *response.mutable_modal_model() = ToProto(*summary);
    return summary.status();
  }

 private:
  absl::Status Begin(const v1::ImportModalModelRequest& first) {
    if (import_) return absl::OkStatus();
    absl::string_view digest = first.name();
    absl::ConsumePrefix(&digest, "modalModels/");
    absl::StatusOr<ModelImport> import = models_->Import(std::string(digest), first.label());
    if (!import.ok()) return import.status();
    import_ = *std::move(import);
    return absl::OkStatus();
  }

  ModelStore* models_;
  std::optional<ModelImport> import_;
};

/// Sends one record after the other, each read on a thread of the pool once the last has gone.
class ExportReactor final : public grpc::ServerWriteReactor<v1::ExportModalModelResponse> {
 public:
  ExportReactor(std::string name, ModelStore& models, WorkPool& pool)
      : name_(std::move(name)), models_(models), pool_(pool) {
    pool_.Run([this] { Begin(); });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    pool_.Run([this] { SendNext(); });
  }

  void OnDone() override { delete this; }

 private:
  void Begin() {
    const absl::StatusOr<std::string> digest = ParseModelName(name_);
    if (!digest.ok()) return Finish(ToGrpcStatus(digest.status()));
    absl::StatusOr<ModelExport> begun = models_.Export(*digest);
    if (!begun.ok()) return Finish(ToGrpcStatus(begun.status()));
    export_ = *std::move(begun);
    SendNext();
  }

  void SendNext() {
    absl::StatusOr<std::optional<v1::ModalModelRecord>> record = export_->Next();
    if (!record.ok()) return Finish(ToGrpcStatus(record.status()));
    if (!record->has_value()) return Finish(grpc::Status::OK);
    *response_.mutable_record() = **std::move(record);
    StartWrite(&response_);
  }

  const std::string name_;
  ModelStore& models_;
  WorkPool& pool_;
  std::optional<ModelExport> export_;
  v1::ExportModalModelResponse response_;
};

}  // namespace

grpc::ServerReadReactor<v1::UploadMeshRequest>* MakeUpload(grpc::CallbackServerContext& context,
                                                           v1::UploadMeshResponse& response,
                                                           MeshStore& meshes, WorkPool& pool) {
  return new ReadReactor<v1::UploadMeshRequest, v1::UploadMeshResponse, MeshSink>(
      context, response, MeshSink(meshes), pool);
}

grpc::ServerReadReactor<v1::ImportModalModelRequest>* MakeImport(
    grpc::CallbackServerContext& context, v1::ImportModalModelResponse& response,
    ModelStore& models, WorkPool& pool) {
  return new ReadReactor<v1::ImportModalModelRequest, v1::ImportModalModelResponse, ModelSink>(
      context, response, ModelSink(models), pool);
}

grpc::ServerWriteReactor<v1::ExportModalModelResponse>* MakeExport(
    const v1::ExportModalModelRequest& request, ModelStore& models, WorkPool& pool) {
  return new ExportReactor(request.name(), models, pool);
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
  return proto;
}

}  // namespace carillon
