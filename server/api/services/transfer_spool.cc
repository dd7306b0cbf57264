// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/transfer_spool.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {

absl::Status TransferSpool::Append(const std::string& serialized) {
  v1::TransferRecord record;
  const bool parsed = record.ParseFromString(serialized);
  if (!parsed || (byte_counts_.empty() && !record.has_header())) {
    return Refusal(absl::StatusCode::kInvalidArgument, "TRANSFER_MALFORMED",
                   "a record of a transfer cannot be read, or comes before its header: export the "
                   "model again");
  }
  const std::string bytes = Delimited(record);
  RETURN_IF_ERROR(Count(record.has_header(), bytes.size()));
  if (!file_) {
    ASSIGN_OR_RETURN(file_, database_->MakeSpool());
  }
  return file_->Append(bytes);
}

absl::Status TransferSpool::Count(bool begins, size_t byte_count) {
  if (begins) {
    byte_counts_.push_back(0);
    header_byte_count_ += byte_count;
  }
  byte_counts_.back() += byte_count;
  byte_count_ += byte_count;
  if (byte_counts_.size() <= kMostTransfers && byte_counts_.back() <= kMostTransferBytes &&
      byte_count_ <= kMostBytes && header_byte_count_ <= kMostHeaderBytes) {
    return absl::OkStatus();
  }
  return Refusal(
      absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
      absl::StrCat("a model is imported with at most ", kMostTransfers, " transfers, of ",
                   kMostTransferBytes >> 20U, " MiB each and ", kMostBytes >> 20U,
                   " MiB together, ", kMostHeaderBytes >> 20U,
                   " MiB of that in headers: import it without transfers, and compute them here"));
}

absl::Status TransferSpool::ForEach(absl::FunctionRef<absl::Status(const StoredTransfer&)> take) {
  if (!file_) return absl::OkStatus();
  RETURN_IF_ERROR(file_->Rewind());
  for (const size_t byte_count : byte_counts_) {
    ASSIGN_OR_RETURN(std::string bytes, file_->Read(byte_count));
    ASSIGN_OR_RETURN(const StoredTransfer transfer, StoredTransfer::Parse(std::move(bytes)));
    RETURN_IF_ERROR(take(transfer));
  }
  return absl::OkStatus();
}

}  // namespace carillon
