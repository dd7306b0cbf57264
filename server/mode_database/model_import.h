// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/model_row.h"
#include "server/mode_database/replacing.h"
#include "server/mode_database/spool_file.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// A model that arrives record by record. Each record is checked when it comes. Only one thread at
/// a time may use an object.
class ModelImport {
 public:
  /// Stores the records that `open` reads from their beginning. Sets `kept` if the same model is
  /// stored already.
  using Store = std::function<absl::StatusOr<ModelSummary>(
      absl::FunctionRef<absl::StatusOr<ModelFileReader>()> open, const ModelSummary& named,
      bool& kept)>;

  /// Collects the records in `file`. Finish stores them by `store` under the digest and the label
  /// of `named`; an empty digest becomes the SHA-256 of the model's file.
  ModelImport(SpoolFile file, ModelSummary named, Store store);
  ModelImport(ModelImport&&) noexcept;
  ModelImport& operator=(ModelImport&&) noexcept;
  ~ModelImport();

  /// Takes the next record. Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss
  /// (MODAL_MODEL_CORRUPT: a hash is wrong), ResourceExhausted (MODAL_MODEL_TOO_LARGE).
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Stores the model durably. No record may follow. If a model with the same records is stored
  /// under the same digest, the stored model is returned, and nothing is changed. Errors:
  /// InvalidArgument (MODAL_MODEL_MALFORMED: records are missing), AlreadyExists
  /// (MODAL_MODEL_EXISTS: the stored model has other records and may not be replaced).
  absl::StatusOr<ModelSummary> Finish();

  /// Returns whether Finish has found the same model stored.
  bool kept() const;

 private:
  struct State;

  std::unique_ptr<State> state_;
};

/// Returns whether the records are those of the model that is stored under the digest of `summary`,
/// byte for byte. If so, fills in `summary`. Returns false if no such model is stored, if it has
/// changed on the disk, or if it may be replaced. Errors: AlreadyExists (MODAL_MODEL_EXISTS).
absl::StatusOr<bool> IsStored(SqliteConnection& connection, ModelFileReader& records,
                              Replacing replacing, ModelSummary& summary);

}  // namespace carillon
