// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Puts a model together from the records that a daemon sends, which has checked their hashes.
class ModelAssembler {
 public:
  /// Errors: InvalidArgument (MODEL_FILE_MALFORMED), after which it is of no further use.
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Call once, last. Errors: as Validate.
  absl::StatusOr<StoredModel> Finish();

 private:
  absl::Status AppendChunk(const v1::ModalModelChunk& chunk);

  StoredModel model_;
};

/// Hands the records of `model` to `sink` in order and stops at its first error, which is returned.
absl::Status SendRecords(const StoredModel& model,
                         const std::function<absl::Status(const v1::ModalModelRecord&)>& sink);

}  // namespace carillon::interchange
