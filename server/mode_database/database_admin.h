// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

class Database;

/// What a database holds, in numbers; see DatabaseStats in admin_service.proto.
struct DatabaseStats {
  uint64_t model_count = 0;
  uint64_t model_bytes = 0;
  uint64_t quarantined_count = 0;
  uint64_t mesh_count = 0;
  uint64_t mesh_bytes = 0;
  uint64_t unfinished_job_count = 0;
  uint64_t job_count = 0;
  uint64_t file_bytes = 0;
  uint64_t free_bytes = 0;
  uint32_t schema_version = 0;
};

absl::StatusOr<DatabaseStats> ReadStats(Database& database);

/// Copies the database as it stands at one moment into a new file (SQLite's online backup); writers
/// go on meanwhile. Errors: ResourceExhausted (DATABASE_FULL), FailedPrecondition
/// (DATABASE_UNUSABLE).
absl::Status BackUp(Database& database, const std::filesystem::path& copy);

/// What a check has found, a line each; nothing where all is well.
using OnFinding = std::function<void(const std::string& line)>;

/// The calls below work on a file that no daemon has open.

/// Looks at everything: SQLite's structure, every hash of every model, every mesh's digest, every
/// intent. Writes nothing. Errors: as ModeDatabase::Open; DataLoss (DATABASE_CORRUPT) where the
/// structure is beyond reading.
absl::Status CheckDatabase(const std::filesystem::path& file, const OnFinding& on_finding);

/// Brings everything that is whole into a new database, which takes the old one's place; that is
/// kept beside it under the name `file`.damaged. What is left out goes to `on_finding`.
/// Errors: FailedPrecondition (DATABASE_UNUSABLE), ResourceExhausted (DATABASE_FULL).
absl::Status RepairDatabase(const std::filesystem::path& file, const OnFinding& on_finding);

/// Puts a copy that BackUp made in the database's place; what was there is kept under the name
/// `file`.replaced. The copy is checked before. Errors: NotFound (FILE_NOT_FOUND), DataLoss
/// (DATABASE_CORRUPT), FailedPrecondition (SCHEMA_TOO_NEW).
absl::Status RestoreDatabase(const std::filesystem::path& file, const std::filesystem::path& copy);

}  // namespace carillon
