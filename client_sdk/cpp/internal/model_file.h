// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon::client {

/// Internal (OUTPUT_NOT_WRITABLE).
absl::Status NotWritable(const std::string& file);

/// Hands the records of a file in the stored form to `sink`, whose error is returned. Errors also:
/// NotFound (FILE_NOT_FOUND), InvalidArgument (MODAL_MODEL_MALFORMED).
absl::Status ReadRecords(const std::string& file,
                         absl::FunctionRef<absl::Status(const v1::ModalModelRecord&)> sink);

}  // namespace carillon::client
