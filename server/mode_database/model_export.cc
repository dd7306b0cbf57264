// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/model_export.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"
#include "server/mode_database/database.h"
#include "server/mode_database/model_sql.h"

namespace carillon {

ModelExport::ModelExport(Database& database, ModelSummary summary, Quarantine quarantine)
    : database_(&database), summary_(std::move(summary)), quarantine_(std::move(quarantine)) {}

absl::StatusOr<ModelExport> ModelExport::Begin(Database& database, ModelSummary summary,
                                               Quarantine quarantine) {
  ModelExport result(database, std::move(summary), std::move(quarantine));
  absl::Status status = database.Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(result.chunk_count_, CountChunks(connection, result.summary_));
    return absl::OkStatus();
  });
  if (absl::IsDataLoss(status)) return result.quarantine_(status);
  RETURN_IF_ERROR(status);
  return result;
}

absl::StatusOr<std::optional<v1::ModalModelRecord>> ModelExport::Next() {
  if (!header_sent_) {
    header_sent_ = true;
    v1::ModalModelRecord record;
    *record.mutable_header() = summary_.header;
    return record;
  }
  if (next_chunk_ == chunk_count_) return std::nullopt;
  std::optional<v1::ModalModelRecord> record;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    return SelectChunks(connection, summary_.revision, next_chunk_, 1, [&](const ChunkView& view) {
      v1::ModalModelChunk& chunk = *record.emplace().mutable_chunk();
      chunk.set_array(view.array);
      chunk.set_offset(view.offset);
      chunk.set_xxh3(view.xxh3);
      chunk.set_data(view.data.data(), view.data.size());
      return absl::OkStatus();
    });
  }));
  if (!record.has_value()) {
    return Refusal(absl::StatusCode::kAborted, "MODAL_MODEL_REPLACED",
                   "the model was replaced or deleted while it was read: export it again");
  }
  if (Xxh3(record->chunk().data()) != record->chunk().xxh3()) {
    return quarantine_(ModelCorrupt(summary_.digest,
                                    absl::StrCat("the hash of chunk ", next_chunk_, " is wrong")));
  }
  ++next_chunk_;
  return record;
}

}  // namespace carillon
