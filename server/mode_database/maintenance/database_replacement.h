// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// Puts a checked database in the place of another. A program that is killed at any moment leaves
/// either the old database or the new one, and loses neither.

/// Suffixes of the files that have a database's content: its log, its count of changes, and the
/// database itself.
inline constexpr std::array kContentSuffixes = {"-wal", "-count", ""};

/// Replaces the database `file` by `fresh`, which no program has open, after a check of its
/// structure. Keeps the old database with its log as `file`.KIND, or as `file`.KIND-2 and so on if
/// a file with that name exists. Returns the name of the kept database, or an empty path if there
/// was none. `file` is absolute and no symbolic link. Errors: FailedPrecondition
/// (DATABASE_UNUSABLE), ResourceExhausted (DATABASE_FULL), DataLoss (DATABASE_CORRUPT); `file` then
/// stays as it was, and `fresh` is removed.
absl::StatusOr<std::filesystem::path> ReplaceDatabase(const std::filesystem::path& file,
                                                      const std::filesystem::path& fresh,
                                                      const std::string& kind);

/// Completes the replacement of `file` that a killed program had begun, if there is one. Errors:
/// FailedPrecondition (DATABASE_UNUSABLE), ResourceExhausted (DATABASE_FULL).
absl::Status CompleteReplacement(const std::filesystem::path& file);

/// Removes a database with all its files. It is no error if there is none.
void RemoveDatabase(const std::filesystem::path& file);

/// The error of a file that cannot be moved, copied or written for this reason.
absl::Status CannotMove(const std::filesystem::path& file, const std::error_code& error);

}  // namespace carillon
