// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/model_file.h"

#include <fcntl.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

constexpr int kReadBytes = 2 << 20;

}  // namespace

absl::Status NotWritable(const std::string& file) {
  return Refusal(
      absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
      absl::StrCat(file,
                   " cannot be written; check its folder, its permissions and the free space"));
}

absl::Status ReadRecords(const std::string& file,
                         absl::FunctionRef<absl::Status(const v1::ModalModelRecord&)> sink) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(file, " cannot be read; check its name and its permissions"));
  }
  google::protobuf::io::FileInputStream in(descriptor, kReadBytes);
  in.SetCloseOnDelete(true);
  while (true) {
    bool at_end = false;
    v1::ModalModelRecord record;
    if (!google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, &in, &at_end)) {
      if (at_end) return absl::OkStatus();
      return Refusal(
          absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
          absl::StrCat(file, " is not a whole file of modal model records; export it again"));
    }
    RETURN_IF_ERROR(sink(record));
  }
}

}  // namespace carillon::client
