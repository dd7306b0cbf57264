// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon::client {

/// Returns Internal (OUTPUT_NOT_WRITABLE) for a file that cannot be written.
absl::Status NotWritable(const std::string& file);

/// Passes the records of a file in the stored form to `sink`, and returns the error of `sink` if
/// there is one. Further errors: NotFound (FILE_NOT_FOUND), InvalidArgument
/// (MODAL_MODEL_MALFORMED).
absl::Status ReadRecords(const std::string& file,
                         absl::FunctionRef<absl::Status(const v1::ModalModelRecord&)> sink);

}  // namespace carillon::client
