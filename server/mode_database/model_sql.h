// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/model_row.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// All SQL statements about modal models. The caller opens the transaction. Every function that
/// reads a model can fail with NotFound (MODAL_MODEL_NOT_FOUND) or DataLoss (MODAL_MODEL_CORRUPT).

absl::Status ModelNotFound(const std::string& digest);
absl::Status TooManyTags(const std::string& digest, uint64_t count);
absl::Status ModelCorrupt(const std::string& digest, absl::string_view what);

absl::StatusOr<ModelSummary> SelectModel(SqliteConnection& connection, const std::string& digest);

/// Calls `on_model` for at most `limit` models below revision `below`, newest first, and
/// `on_damaged` with the digest of each row that is damaged. Returns whether the call ended before
/// `limit` because the headers have reached kMaxHeaderBytes.
absl::StatusOr<bool> SelectModels(SqliteConnection& connection, const ModelFilter& filter,
                                  int64_t below, int64_t limit,
                                  absl::FunctionRef<void(ModelSummary)> on_model,
                                  absl::FunctionRef<void(std::string, absl::Status)> on_damaged);

/// Returns the material remembered for the model of this digest, or nothing if there is none or its
/// row is damaged.
absl::StatusOr<std::optional<v1::Material>> SelectMaterial(SqliteConnection& connection,
                                                           const std::string& digest);

absl::Status StoreMaterial(SqliteConnection& connection, const std::string& digest,
                           const v1::Material& material);

/// Calls `on_chunk` for the chunks numbered from `first` on, at most `limit`.
absl::Status SelectChunks(SqliteConnection& connection, int64_t revision, int64_t first,
                          int64_t limit,
                          absl::FunctionRef<absl::Status(const ChunkView&)> on_chunk);

/// Returns the whole model after checking every hash.
absl::StatusOr<ModalModel> ReadModel(SqliteConnection& connection, const ModelSummary& summary);

/// Returns the eigenvalues alone, after checking their hashes.
absl::StatusOr<std::vector<double>> ReadEigenvalues(SqliteConnection& connection,
                                                    const ModelSummary& summary);

/// Reads and checks every record and inserts the model as a new revision, which keeps the label and
/// the pin of the revision that it replaces. Fills in `summary`.
absl::Status InsertModel(SqliteConnection& connection, ModelFileReader& records,
                         ModelSummary& summary);

/// Inserts a copy of the model that `summary` describes under another digest, with unchanged
/// chunks. `summary` then describes the copy.
absl::Status InsertCopy(SqliteConnection& connection, const std::string& digest,
                        ModelSummary& summary);

/// Writes the label, the pin, the material and the tags that `change` gives.
absl::Status UpdateModel(SqliteConnection& connection, const std::string& digest,
                         const ModelChange& change);

/// Writes the time at which the model sounded last.
absl::Status StoreSounded(SqliteConnection& connection, const std::string& digest, int64_t unix_ms);

/// Puts the model into quarantine. Returns false if it was there already.
absl::StatusOr<bool> QuarantineModel(SqliteConnection& connection, const std::string& digest);

/// Returns the number of the model's chunks, after checking that none is missing.
absl::StatusOr<int64_t> CountChunks(SqliteConnection& connection, const ModelSummary& summary);

/// Calls `on_model` for all models. The models that sounded (or, if they never sounded, were
/// stored) longest ago come first.
absl::Status SelectSizes(SqliteConnection& connection,
                         absl::FunctionRef<void(const ModelSize&)> on_model);

/// Deletes model, tags, material and job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
absl::Status DeleteModelRows(SqliteConnection& connection, const std::string& digest);

}  // namespace carillon
