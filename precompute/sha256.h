// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace carillon::precompute {

/// SHA-256 of a file's bytes, lower-case hexadecimal. Errors: NotFound MESH_FILE_NOT_READABLE.
absl::StatusOr<std::string> Sha256OfFile(const std::string& path);

}  // namespace carillon::precompute
