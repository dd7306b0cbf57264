// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/file_refusal.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::interchange {

absl::Status Malformed(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODEL_FILE_MALFORMED",
                 absl::StrCat(what, ": copy the file again, or write it anew"));
}

absl::Status Incomplete(absl::string_view what, absl::string_view repair) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODEL_FILE_MALFORMED",
                 absl::StrCat(what, ": ", repair));
}

absl::Status TooLarge(absl::string_view what) {
  return Refusal(absl::StatusCode::kResourceExhausted, "MODAL_MODEL_TOO_LARGE",
                 absl::StrCat(what, ": use the stored form (.model)"));
}

absl::Status OutOfMemory(absl::string_view path) {
  return Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                 absl::StrCat("the memory does not suffice to read ", path,
                              ": use a machine with more, or a smaller model"));
}

}  // namespace carillon::interchange
