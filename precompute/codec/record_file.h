// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/transfer.pb.h"

namespace carillon::precompute {

/// The program and its version, as stored files name it.
extern const char kSolver[];

using Bytes = std::span<const std::byte>;

template <class T>
Bytes BytesOf(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

/// Writes the header and then the arrays, in protobuf's delimited form. The arrays are split into
/// chunks, and each chunk has its hash. The file is written under a temporary name next to `path`,
/// flushed to the disk and renamed, so that `path` never contains half a result. A device or a pipe
/// at `path` is written to directly. Record is v1::ModalModelRecord or v1::TransferRecord. Errors:
/// Internal OUTPUT_NOT_WRITABLE.
template <class Record>
absl::Status WriteRecordFile(const std::string& path, const Record& header,
                             std::span<const Bytes> arrays);

/// Passes each record of a stored modal model to `take`, in order, after checking the hash of a
/// chunk. Stops at the first error of `take` and returns it.
/// Errors: NotFound FILE_NOT_FOUND, InvalidArgument MODAL_MODEL_MALFORMED, DataLoss
/// MODAL_MODEL_CORRUPT.
absl::Status ReadModelRecords(const std::string& path,
                              const std::function<absl::Status(v1::ModalModelRecord&)>& take);

}  // namespace carillon::precompute
