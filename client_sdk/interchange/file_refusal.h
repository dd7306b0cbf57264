// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon::interchange {

/// The file breaks the rules of its format, or is damaged: InvalidArgument (MODEL_FILE_MALFORMED).
absl::Status Malformed(absl::string_view what);

/// The file is whole, but lacks what a modal model needs: InvalidArgument (MODEL_FILE_INCOMPLETE).
/// `repair` says how to add it.
absl::Status Incomplete(absl::string_view what, absl::string_view repair);

/// More than the format or the reader holds: ResourceExhausted (MODEL_FILE_TOO_LARGE).
absl::Status TooLarge(absl::string_view what);

/// The memory did not suffice for the file: ResourceExhausted (OUT_OF_MEMORY).
absl::Status OutOfMemory(absl::string_view path);

}  // namespace carillon::interchange
