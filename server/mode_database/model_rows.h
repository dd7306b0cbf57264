// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/modal_model.h"
#include "server/mode_database/model_codec.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// The rows of a modal model, within a transaction of the caller. Every function that reads them
/// can fail with NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).

absl::Status ModelNotFound(const std::string& digest);
absl::Status ModelCorrupt(const std::string& digest, absl::string_view what);

absl::StatusOr<ModelSummary> SelectModel(SqliteConnection& connection, const std::string& digest);

/// Calls `on_model` for at most `limit` models below revision `below`, newest first, and
/// `on_damaged` with the digest of each row that is damaged.
absl::Status SelectModels(SqliteConnection& connection, const ModelFilter& filter, int64_t below,
                          int64_t limit, absl::FunctionRef<void(ModelSummary)> on_model,
                          absl::FunctionRef<void(std::string, absl::Status)> on_damaged);

/// The material remembered for the model of this digest; absent: there is none, or its row is
/// damaged.
absl::StatusOr<std::optional<v1::Material>> SelectMaterial(SqliteConnection& connection,
                                                           const std::string& digest);

absl::Status StoreMaterial(SqliteConnection& connection, const std::string& digest,
                           const v1::Material& material);

/// Calls `on_chunk` for the chunks numbered from `first` on, at most `limit`.
absl::Status SelectChunks(SqliteConnection& connection, int64_t revision, int64_t first,
                          int64_t limit,
                          absl::FunctionRef<absl::Status(const ChunkView&)> on_chunk);

/// The whole model, every hash checked.
absl::StatusOr<ModalModel> ReadModel(SqliteConnection& connection, const ModelSummary& summary);

/// Reads and checks every record and inserts the model as a new revision, which keeps the label and
/// the pin of the revision that it replaces. Fills in `summary`.
absl::Status InsertModel(SqliteConnection& connection, ModelFileReader& records,
                         ModelSummary& summary);

/// Inserts a copy of the model that `summary` describes under another digest, with unchanged
/// chunks. `summary` then describes the copy.
absl::Status InsertCopy(SqliteConnection& connection, const std::string& digest,
                        ModelSummary& summary);

/// Deletes model, tags, material and job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
absl::Status DeleteModelRows(SqliteConnection& connection, const std::string& digest);

}  // namespace carillon
