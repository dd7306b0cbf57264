// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/model_import.h"

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/base/usable_memory.h"
#include "server/base/xxh3.h"
#include "server/mode_database/codec/model_checker.h"
#include "server/mode_database/model_sql.h"

namespace carillon {
namespace {

/// A model is read into memory whole when it sounds.
absl::Status CheckSize(uint64_t array_bytes) {
  const uint64_t most_bytes = UsableMemoryBytes() / 2;
  if (array_bytes <= most_bytes) return absl::OkStatus();
  return Refusal(absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
                 absl::StrCat("the arrays of the model have ", array_bytes,
                              " bytes; half of the "
                              "memory here is ",
                              most_bytes,
                              ": keep fewer modes, or a coarser "
                              "surface"));
}

absl::Status CheckModeCount(uint32_t mode_count) {
  if (mode_count <= kMaxImportedModeCount) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
      absl::StrCat("the model has ", mode_count, " modes; at most ", kMaxImportedModeCount,
                   " are taken, of which an object sounds with 800: keep fewer"));
}

absl::Status CheckHeaderSize(size_t header_bytes) {
  if (header_bytes <= kMaxHeaderBytes) return absl::OkStatus();
  return Refusal(absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
                 absl::StrCat("the header of the model has ", header_bytes, " bytes; at most ",
                              kMaxHeaderBytes, " are taken: shorten its warnings"));
}

enum class Comparison { kSame, kOther, kDamaged };

bool IsSameChunk(const v1::ModalModelChunk& sent, const ChunkView& stored) {
  return sent.array() == stored.array && sent.offset() == stored.offset &&
         sent.xxh3() == stored.xxh3 && sent.data() == stored.data;
}

/// Compares the stored model with the records of a whole model up to the first difference.
absl::StatusOr<Comparison> Compare(SqliteConnection& connection, ModelFileReader& records,
                                   const ModelSummary& stored) {
  ASSIGN_OR_RETURN(std::optional<v1::ModalModelRecord> sent, records.Next());
  if (sent->header().SerializeAsString() != stored.header.SerializeAsString()) {
    return Comparison::kOther;
  }
  std::optional<Comparison> difference;
  const auto compare = [&](const ChunkView& chunk) -> absl::Status {
    ASSIGN_OR_RETURN(sent, records.Next());
    if (sent.has_value() && IsSameChunk(sent->chunk(), chunk)) return absl::OkStatus();
    difference = Xxh3(chunk.data) == chunk.xxh3 ? Comparison::kOther : Comparison::kDamaged;
    return absl::CancelledError("the models differ");
  };
  const absl::Status status =
      SelectChunks(connection, stored.revision, 0, std::numeric_limits<int64_t>::max(), compare);
  if (difference.has_value()) return *difference;
  if (absl::IsDataLoss(status)) return Comparison::kDamaged;
  RETURN_IF_ERROR(status);
  ASSIGN_OR_RETURN(sent, records.Next());
  // The stored model lacks a chunk that its header announces.
  return sent.has_value() ? Comparison::kDamaged : Comparison::kSame;
}

absl::Status ModelExists(const ModelSummary& stored, Replacing replacing) {
  const absl::string_view repair =
      replacing == Replacing::kNever
          ? "import it without a name, so that the name is made from its content, or let a caller "
            "with the role administer delete or replace the stored model"
          : "the stored model is pinned, so unpin it, delete it, or import without a name";
  return Refusal(absl::StatusCode::kAlreadyExists, "MODAL_MODEL_EXISTS",
                 absl::StrCat("modalModels/", stored.digest,
                              " is stored already with other content: ", repair));
}

}  // namespace

struct ModelImport::State {
  SpoolFile file;
  ModelSummary named;
  Store store;
  bool kept = false;
  ModelChecker checker{};
  Sha256 sha{};
};

ModelImport::ModelImport(SpoolFile file, ModelSummary named, Store store)
    : state_(std::make_unique<State>(State{std::move(file), std::move(named), std::move(store)})) {}
ModelImport::ModelImport(ModelImport&&) noexcept = default;
ModelImport& ModelImport::operator=(ModelImport&&) noexcept = default;
ModelImport::~ModelImport() = default;

absl::Status ModelImport::Append(const v1::ModalModelRecord& record) {
  if (record.has_header()) RETURN_IF_ERROR(CheckHeaderSize(record.header().ByteSizeLong()));
  RETURN_IF_ERROR(state_->checker.Check(record));
  if (record.has_header()) {
    RETURN_IF_ERROR(CheckSize(state_->checker.array_bytes()));
    RETURN_IF_ERROR(CheckModeCount(record.header().mode_count()));
  }
  const std::string bytes = Delimited(record);
  state_->sha.Update(bytes);
  return state_->file.Append(bytes);
}

absl::StatusOr<ModelSummary> ModelImport::Finish() {
  RETURN_IF_ERROR(state_->checker.Finish());
  if (state_->named.digest.empty()) state_->named.digest = state_->sha.Finish();
  const auto open = [&file = state_->file]() -> absl::StatusOr<ModelFileReader> {
    RETURN_IF_ERROR(file.Rewind());
    return ModelFileReader(file.descriptor());
  };
  return state_->store(open, state_->named, state_->kept);
}

bool ModelImport::kept() const { return state_->kept; }

absl::StatusOr<bool> IsStored(SqliteConnection& connection, ModelFileReader& records,
                              Replacing replacing, ModelSummary& summary) {
  absl::StatusOr<ModelSummary> stored = SelectModel(connection, summary.digest);
  if (absl::IsNotFound(stored.status()) || absl::IsDataLoss(stored.status())) return false;
  RETURN_IF_ERROR(stored.status());
  ASSIGN_OR_RETURN(const Comparison comparison, Compare(connection, records, *stored));
  if (comparison == Comparison::kDamaged) return false;
  if (comparison == Comparison::kSame) {
    summary = *std::move(stored);
    return true;
  }
  if (replacing == Replacing::kUnlessPinned && !stored->pinned) return false;
  return ModelExists(*stored, replacing);
}

}  // namespace carillon
