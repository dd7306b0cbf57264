// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/modal_model.h"
#include "server/mode_database/model_codec.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// The rows of a modal model, within a transaction of the caller's. Errors of what is read:
/// NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).

absl::Status ModelNotFound(const std::string& digest);
absl::Status ModelCorrupt(const std::string& digest, absl::string_view what);

absl::StatusOr<ModelSummary> SelectModel(SqliteConnection& connection, const std::string& digest);

/// Newest first: at most `limit` below revision `below`. A row that is damaged goes to `on_damaged`
/// with its digest instead.
absl::Status SelectModels(SqliteConnection& connection, const ModelFilter& filter, int64_t below,
                          int64_t limit, absl::FunctionRef<void(ModelSummary)> on_model,
                          absl::FunctionRef<void(std::string, absl::Status)> on_damaged);

/// Calls `on_chunk` for the chunks numbered from `first` on, at most `limit`.
absl::Status SelectChunks(SqliteConnection& connection, int64_t revision, int64_t first,
                          int64_t limit,
                          absl::FunctionRef<absl::Status(const ChunkView&)> on_chunk);

/// The whole model, every hash checked.
absl::StatusOr<ModalModel> ReadModel(SqliteConnection& connection, const ModelSummary& summary);

/// Reads and checks every record and inserts it in the place of an older revision, whose label
/// stays and whose being pinned does. Fills in `summary`.
absl::Status InsertModel(SqliteConnection& connection, ModelFileReader& records,
                         ModelSummary& summary);

/// Inserts the model that `summary` describes once more under another digest, with all its chunks
/// as they are. Changes what is of the revision in `summary`.
absl::Status InsertCopy(SqliteConnection& connection, const std::string& digest,
                        ModelSummary& summary);

/// Deletes model, tags and job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
absl::Status DeleteModelRows(SqliteConnection& connection, const std::string& digest);

}  // namespace carillon
