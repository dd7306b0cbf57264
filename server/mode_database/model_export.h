// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/model_row.h"

namespace carillon {

class Database;

/// Reads a stored model record by record, byte for byte. No transaction stays open between two
/// records, so an export ends with an error if the model is replaced. Only one thread at a time may
/// use an object.
class ModelExport {
 public:
  /// Puts the model into quarantine. Returns the error for the reader.
  using Quarantine = std::function<absl::Status(const absl::Status& why)>;

  /// Begins with the header of `summary`. `database` must outlive the object. Errors: DataLoss
  /// (MODAL_MODEL_CORRUPT: chunks are missing, and the model goes into quarantine).
  static absl::StatusOr<ModelExport> Begin(Database& database, ModelSummary summary,
                                           Quarantine quarantine);

  /// Returns the next record, or nullopt after the last one. Errors: DataLoss (MODAL_MODEL_CORRUPT,
  /// and the model goes into quarantine), Aborted (MODAL_MODEL_REPLACED: replaced or deleted
  /// meanwhile).
  absl::StatusOr<std::optional<v1::ModalModelRecord>> Next();

 private:
  ModelExport(Database& database, ModelSummary summary, Quarantine quarantine);

  Database* database_;
  ModelSummary summary_;
  Quarantine quarantine_;
  bool header_sent_ = false;
  int64_t next_chunk_ = 0;
  int64_t chunk_count_ = 0;
};

}  // namespace carillon
