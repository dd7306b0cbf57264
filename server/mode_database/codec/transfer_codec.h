// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/transfer.pb.h"
#include "proto/cpp/transfer_format.h"
#include "server/mode_database/codec/transfer.h"

namespace carillon {

/// A transfer in its stored form (proto/carillon/v1/transfer.proto) that has passed all checks: of
/// hashes, of the order and completeness of the chunks, of the shapes of the arrays, and that
/// numbers are finite and indices in range.
class StoredTransfer {
 public:
  /// Checks `bytes`, the records in protobuf's delimited form. Errors: InvalidArgument
  /// (TRANSFER_MALFORMED), DataLoss (TRANSFER_CORRUPT: a hash is wrong).
  static absl::StatusOr<StoredTransfer> Parse(std::string bytes);

  /// Reads and checks a file. Errors: NotFound (FILE_NOT_FOUND), and those of Parse.
  static absl::StatusOr<StoredTransfer> ReadFile(const std::filesystem::path& file);

  /// Number of arrays that the server reads, which are the first of kTransferArrays. Arrays of a
  /// later minor version are kept with the bytes, and only their hashes are checked.
  static constexpr size_t kReadArrayCount = 10;

  const v1::TransferHeader& header() const { return header_; }
  const std::string& bytes() const { return bytes_; }
  /// Returns the ascending eigenvalues of the modal model for a unit material.
  std::vector<double> Eigenvalues() const;
  Transfer Decode() const;
  /// Returns the records in order.
  std::vector<v1::TransferRecord> Records() const;

 private:
  absl::Status ParseRecords();
  absl::Status CheckHeader();
  absl::Status FindArrays();
  absl::Status TakeChunk(const v1::ModalModelChunk& chunk);
  absl::Status CheckNumbers() const;
  template <typename T>
  std::vector<T> Array(size_t index) const;

  v1::TransferHeader header_;
  std::string bytes_;
  std::vector<std::string> arrays_;              ///< the arrays, in the order of the header
  std::array<size_t, kReadArrayCount> place_{};  ///< index in arrays_ of each of kTransferArrays
};

/// Returns the bytes of a record in a file: the record's length as a varint, then the record.
std::string Delimited(const v1::TransferRecord& record);

}  // namespace carillon
