// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Reads a file that holds secrets. Errors: FailedPrecondition (`reason`: it cannot be read, is
/// empty or over 1 MiB, belongs to a user other than this one and root, others may read it, or its
/// group may change it).
absl::StatusOr<std::string> ReadPrivateFile(const std::string& path, absl::string_view reason);

/// Reads a file that everybody may read. Errors: those of ReadPrivateFile, except those about the
/// owner and the mode.
absl::StatusOr<std::string> ReadPublicFile(const std::string& path, absl::string_view reason);

}  // namespace carillon
