// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon::interchange {

/// Refuses a file that breaks the rules of its format or is damaged: InvalidArgument
/// (MODEL_FILE_MALFORMED).
absl::Status Malformed(absl::string_view what);

/// Refuses a file that is whole but lacks a part of a modal model: InvalidArgument
/// (MODEL_FILE_MALFORMED). `repair` says how to add that part.
absl::Status Incomplete(absl::string_view what, absl::string_view repair);

/// Refuses a file that is larger than its format or the reader allows: ResourceExhausted
/// (MODAL_MODEL_TOO_LARGE).
absl::Status TooLarge(absl::string_view what);

/// Refuses a file for which the memory did not suffice: ResourceExhausted (OUT_OF_MEMORY).
absl::Status OutOfMemory(absl::string_view path);

}  // namespace carillon::interchange
