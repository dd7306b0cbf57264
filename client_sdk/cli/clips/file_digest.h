// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace carillon::cli {

/// Returns the SHA-256 of a file, 64 lower-case hexadecimal digits. Errors: NotFound
/// (FILE_NOT_FOUND) if it cannot be read.
absl::StatusOr<std::string> FileDigest(const std::string& path);

}  // namespace carillon::cli
