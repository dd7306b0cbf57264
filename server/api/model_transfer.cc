// SPDX-License-Identifier: Apache-2.0
#include "server/api/model_transfer.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/read_call.h"
#include "server/api/resource_name.h"
#include "server/api/stream_call.h"

namespace carillon {
namespace {

class MeshSink {
 public:
  explicit MeshSink(MeshStore& meshes) : meshes_(&meshes) {}

  absl::Status Append(const v1::UploadMeshRequest& request) {
    RETURN_IF_ERROR(Begin());
    return upload_->Append(request.data());
  }

  absl::Status Finish(v1::UploadMeshResponse& response) {
    RETURN_IF_ERROR(Begin());
    ASSIGN_OR_RETURN(const StoredMesh mesh, upload_->Finish());
    response.set_mesh_digest(mesh.digest);
    response.set_byte_count(mesh.byte_count);
    return absl::OkStatus();
  }

 private:
  absl::Status Begin() {
    if (upload_) return absl::OkStatus();
    ASSIGN_OR_RETURN(upload_, meshes_->Begin());
    return absl::OkStatus();
  }

  MeshStore* meshes_;
  std::optional<MeshUpload> upload_;
};

class ModelSink {
 public:
  explicit ModelSink(ModelStore& models) : models_(&models) {}

  absl::Status Append(const v1::ImportModalModelRequest& request) {
    RETURN_IF_ERROR(Begin(request));
    return import_->Append(request.record());
  }

  absl::Status Finish(v1::ImportModalModelResponse& response) {
    if (!import_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                     "no record was sent; send the header, then every chunk");
    }
    ASSIGN_OR_RETURN(const ModelSummary summary, import_->Finish());
    *response.mutable_modal_model() = ToProto(summary);
    return absl::OkStatus();
  }

 private:
  absl::Status Begin(const v1::ImportModalModelRequest& first) {
    if (import_) return absl::OkStatus();
    absl::string_view digest = first.name();
    absl::ConsumePrefix(&digest, "modalModels/");
    ASSIGN_OR_RETURN(import_, models_->Import(std::string(digest), first.label()));
    return absl::OkStatus();
  }

  ModelStore* models_;
  std::optional<ModelImport> import_;
};

/// Sends a model record by record.
class ExportCall final : public ServerStream<v1::ExportModalModelResponse> {
 public:
  ExportCall(std::string name, ModelStore& models, ThreadPool& pool)
      : StreamWriter(&pool), name_(std::move(name)), models_(models) {
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> Fill(v1::ExportModalModelResponse& response) override {
    if (!export_) {
      ASSIGN_OR_RETURN(const std::string digest, ParseModelName(name_));
      ASSIGN_OR_RETURN(export_, models_.Export(digest));
    }
    ASSIGN_OR_RETURN(std::optional<v1::ModalModelRecord> record, export_->Next());
    if (!record) return Supply::kEnd;
    *response.mutable_record() = *std::move(record);
    return Supply::kMessage;
  }

  const std::string name_;
  ModelStore& models_;
  std::optional<ModelExport> export_;
};

}  // namespace

grpc::ServerReadReactor<v1::UploadMeshRequest>* MakeUpload(grpc::CallbackServerContext& context,
                                                           v1::UploadMeshResponse& response,
                                                           MeshStore& meshes, ThreadPool& pool) {
  return new ReadCall<v1::UploadMeshRequest, v1::UploadMeshResponse, MeshSink>(
      context, response, MeshSink(meshes), pool);
}

grpc::ServerReadReactor<v1::ImportModalModelRequest>* MakeImport(
    grpc::CallbackServerContext& context, v1::ImportModalModelResponse& response,
    ModelStore& models, ThreadPool& pool) {
  return new ReadCall<v1::ImportModalModelRequest, v1::ImportModalModelResponse, ModelSink>(
      context, response, ModelSink(models), pool);
}

grpc::ServerWriteReactor<v1::ExportModalModelResponse>* MakeExport(
    const v1::ExportModalModelRequest& request, ModelStore& models, ThreadPool& pool) {
  return new ExportCall(request.name(), models, pool);
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
