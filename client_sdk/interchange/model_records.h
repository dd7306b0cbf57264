// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Assembles a model from the records that a daemon sends. The daemon has checked their hashes.
class ModelAssembler {
 public:
  /// Takes the next record. After an error the assembler is of no further use. Errors:
  /// InvalidArgument (MODEL_FILE_MALFORMED).
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Returns the model. Call it once, after the last record. Errors: those of Validate().
  absl::StatusOr<StoredModel> Finish();

 private:
  absl::Status AppendChunk(const v1::ModalModelChunk& chunk);

  StoredModel model_;
};

/// Passes the records of `model` to `sink` in order. Stops at the first error of `sink` and returns
/// it.
absl::Status SendRecords(const StoredModel& model,
                         const std::function<absl::Status(const v1::ModalModelRecord&)>& sink);

}  // namespace carillon::interchange
