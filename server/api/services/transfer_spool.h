// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "server/mode_database/codec/transfer_codec.h"
#include "server/mode_database/database.h"
#include "server/mode_database/spool_file.h"

namespace carillon {

/// The transfers of a model that is being imported. They wait on the disk, so that an import that
/// is never finished takes no memory. Only one thread at a time may use an object.
class TransferSpool {
 public:
  static constexpr size_t kMostTransfers = 64;
  static constexpr size_t kMostTransferBytes = size_t{256} << 20U;
  static constexpr size_t kMostBytes = size_t{1} << 30U;        ///< of all transfers
  static constexpr size_t kMostHeaderBytes = size_t{1} << 20U;  ///< of the headers of all transfers

  /// The file is made in the folder of `database`.
  explicit TransferSpool(Database& database) : database_(&database) {}

  /// Appends a record of a transfer. A header begins the next transfer. Errors: InvalidArgument
  /// (TRANSFER_MALFORMED), ResourceExhausted (MODAL_MODEL_TOO_LARGE), and those of SpoolFile.
  absl::Status Append(const std::string& serialized);

  /// Calls `take` with each transfer, of which one at a time is in memory. Errors: those of
  /// StoredTransfer::Parse, of SpoolFile and of `take`.
  absl::Status ForEach(absl::FunctionRef<absl::Status(const StoredTransfer&)> take);

 private:
  absl::Status Count(bool begins, size_t byte_count);

  Database* database_;
  std::optional<SpoolFile> file_;
  std::vector<size_t> byte_counts_;  ///< size of each transfer
  size_t byte_count_ = 0;
  size_t header_byte_count_ = 0;
};

}  // namespace carillon
