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
#include "server/mode_database/transfer.h"

namespace carillon {

/// A transfer in its stored form (proto/carillon/v1/transfer.proto) that has been checked: hashes,
/// the order and completeness of the chunks, the shapes of the arrays, finite numbers, indices in
/// range.
class StoredTransfer {
 public:
  /// `bytes`: the records in protobuf's delimited form.
  /// Errors: InvalidArgument (TRANSFER_MALFORMED), DataLoss (TRANSFER_CORRUPT: a hash is wrong).
  static absl::StatusOr<StoredTransfer> Parse(std::string bytes);

  /// Errors: NotFound (FILE_NOT_FOUND), and those of Parse.
  static absl::StatusOr<StoredTransfer> ReadFile(const std::filesystem::path& file);

  /// The arrays that the server reads: the first ones of kTransferArrays. Others, of a later minor
  /// version, are kept with the bytes and only checked by their hashes.
  static constexpr size_t kReadArrayCount = 10;

  const v1::TransferHeader& header() const { return header_; }
  const std::string& bytes() const { return bytes_; }
  /// The eigenvalues of the modal model, unit material, ascending.
  std::vector<double> Eigenvalues() const;
  Transfer Decode() const;
  /// The records, in order.
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
  std::vector<std::string> arrays_;              ///< as in the header
  std::array<size_t, kReadArrayCount> place_{};  ///< in arrays_, of each of kTransferArrays
};

/// The bytes of a record in a file: its length as a varint, then the record.
std::string Delimited(const v1::TransferRecord& record);

}  // namespace carillon
