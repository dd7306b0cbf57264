// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/model_streams.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/read_call.h"
#include "server/api/call/send_call.h"
#include "server/api/convert/resource_name.h"
#include "server/mode_database/codec/imported_figures.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/transfer_codec.h"
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
        log_event_(std::move(target.log_event)) {}

  absl::Status Append(const v1::ImportModalModelRequest& request) {
    RETURN_IF_ERROR(Begin(request));
    if (request.record().record_case() == v1::ModalModelRecord::kTransfer) {
      return AppendTransfer(request.record().transfer());
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
    std::vector<StoredTransfer> transfers;
    for (std::string& bytes : transfers_) {
      ASSIGN_OR_RETURN(transfers.emplace_back(), StoredTransfer::Parse(std::move(bytes)));
      RETURN_IF_ERROR(CheckFigures(transfers.back().header()));
    }
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
    for (const StoredTransfer& transfer : transfers) {
      RETURN_IF_ERROR(database_->transfers().Put(summary.digest, transfer, replacing).status());
    }
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

  /// Appends a record of a transfer. A header begins the next transfer.
  absl::Status AppendTransfer(const std::string& serialized) {
    v1::TransferRecord record;
    const bool parsed = record.ParseFromString(serialized);
    if (!parsed || (transfers_.empty() && !record.has_header())) {
      return Refusal(
          absl::StatusCode::kInvalidArgument, "TRANSFER_MALFORMED",
          "a record of a transfer cannot be read, or comes before its header: export the "
          "model again");
    }
    if (record.has_header()) transfers_.emplace_back();
    transfers_.back() += Delimited(record);
    transfer_byte_count_ += serialized.size();
    if (transfer_byte_count_ <= kMostTransferBytes) return absl::OkStatus();
    return Refusal(
        absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
        absl::StrCat("a model is imported with at most ", kMostTransferBytes >> 20U,
                     " MiB of transfers: import it without them, and compute them here"));
  }

  static constexpr size_t kMostTransferBytes = size_t{256} << 20U;

  ModeDatabase* database_;
  Replacing replacing_;
  EventSink log_event_;
  std::optional<ModelImport> import_;
  std::vector<std::string> transfers_;  // records in protobuf's delimited form
  size_t transfer_byte_count_ = 0;
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
    if (record && request_.without_shapes() && IsShapes(*record)) record = std::nullopt;
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

  /// Returns whether a record is a chunk of the shapes, which are the last array of a model. Drops
  /// the array from a header.
  bool IsShapes(v1::ModalModelRecord& record) {
    if (!record.has_header()) return record.chunk().array() >= array_count_;
    auto& arrays = *record.mutable_header()->mutable_arrays();
    if (!arrays.empty() && arrays.rbegin()->name() == "shapes") arrays.RemoveLast();
    array_count_ = static_cast<uint32_t>(arrays.size());
    return false;
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
  uint32_t array_count_ = 0;
  std::deque<StoredTransfer> transfers_;
  std::deque<v1::TransferRecord> records_;
};

/// Returns `chosen`, or all of `count` if nothing is chosen. Errors: InvalidArgument
/// (INVALID_SETTINGS).
absl::StatusOr<std::vector<uint32_t>> Chosen(
    const google::protobuf::RepeatedField<uint32_t>& chosen, size_t count, absl::string_view what) {
  std::vector<uint32_t> numbers(chosen.begin(), chosen.end());
  for (const uint32_t number : numbers) {
    if (number < count) continue;
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat(what, " has ", number, "; the model has ", count, " of them, counted from 0"));
  }
  if (!numbers.empty()) return numbers;
  numbers.resize(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

/// Sends the shapes of modes at vertices, mode by mode.
class ShapesCall final : public SendCall<v1::GetShapesResponse> {
 public:
  ShapesCall(grpc::CallbackServerContext& context, const v1::GetShapesRequest& request,
             ModeDatabase& database, ThreadPool& pool, CallBounds bounds)
      : SendCall(context, std::move(bounds), pool), request_(request), database_(database) {
    StartWriting();
  }

 private:
  static constexpr size_t kMostVertices = 100'000;

  absl::StatusOr<Supply> FillNext(v1::GetShapesResponse& response) override {
    if (!model_) RETURN_IF_ERROR(Begin());
    response.Clear();
    for (size_t sent = 0; mode_ < modes_.size() && sent < kMostVertices;) {
      sent += AddPart(*response.add_shapes());
    }
    return response.shapes().empty() ? Supply::kEnd : Supply::kMessage;
  }

  absl::Status Begin() {
    ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request_.name()));
    ASSIGN_OR_RETURN(model_, database_.models().Find(digest));
    ASSIGN_OR_RETURN(modes_, Chosen(request_.modes(), model_->mode_count(), "modes"));
    ASSIGN_OR_RETURN(vertices_, Chosen(request_.vertices(), model_->vertices.size(), "vertices"));
    return absl::OkStatus();
  }

  /// Adds the next vertices of the next mode. Returns their number.
  size_t AddPart(v1::ModeShape& shape) {
    const auto rest = std::span(vertices_).subspan(vertex_);
    const auto part = rest.first(std::min(rest.size(), kMostVertices));
    std::vector<float> values;
    values.reserve(3 * part.size());
    float largest = 0;
    for (const uint32_t vertex : part) {
      for (size_t axis = 0; axis < 3; ++axis) {
        const float value =
            model_->shapes[(size_t{3} * vertex + axis) * model_->mode_count() + modes_[mode_]];
        values.push_back(value);
        largest = std::max(largest, std::abs(value));
      }
    }
    shape.set_mode(modes_[mode_]);
    shape.set_first_vertex(static_cast<uint32_t>(vertex_));
    shape.set_scale(largest / 32767);
    AppendIntegers(values, largest > 0 ? 32767 / largest : 0, *shape.mutable_components());
    vertex_ += part.size();
    if (vertex_ == vertices_.size()) {
      vertex_ = 0;
      ++mode_;
    }
    return part.size();
  }

  /// Appends each value times `factor` as 16 bits, little endian.
  static void AppendIntegers(std::span<const float> values, float factor, std::string& bytes) {
    bytes.reserve(2 * values.size());
    for (const float value : values) {
      const auto integer = static_cast<uint16_t>(static_cast<int16_t>(std::lrint(value * factor)));
      bytes.push_back(static_cast<char>(integer & 0xffU));
      bytes.push_back(static_cast<char>(integer >> 8U));
    }
  }

  const v1::GetShapesRequest request_;
  ModeDatabase& database_;
  std::shared_ptr<const ModalModel> model_;
  std::vector<uint32_t> modes_;
  std::vector<uint32_t> vertices_;
  size_t mode_ = 0;  // places in modes_ and vertices_
  size_t vertex_ = 0;
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

grpc::ServerWriteReactor<v1::GetShapesResponse>* MakeShapes(grpc::CallbackServerContext& context,
                                                            const v1::GetShapesRequest& request,
                                                            ModeDatabase& database,
                                                            ThreadPool& pool, CallBounds bounds) {
  return new ShapesCall(context, request, database, pool, std::move(bounds));
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
