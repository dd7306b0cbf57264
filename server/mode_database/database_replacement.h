// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// Puts a checked database in the place of another. A program that is killed at any moment leaves
/// either the old database or the new one, and loses neither.

/// Replaces the database `file` by `fresh`, which no program has open. Keeps the old database with
/// its log as `file`.KIND, or as `file`.KIND-2 and so on if that exists. Returns the name of the
/// kept database, or an empty path if there was none. Errors: FailedPrecondition
/// (DATABASE_UNUSABLE).
absl::StatusOr<std::filesystem::path> ReplaceDatabase(const std::filesystem::path& file,
                                                      const std::filesystem::path& fresh,
                                                      const std::string& kind);

/// Completes the replacement of `file` that a killed program had begun, if there is one. Errors:
/// FailedPrecondition (DATABASE_UNUSABLE).
absl::Status CompleteReplacement(const std::filesystem::path& file);

}  // namespace carillon
