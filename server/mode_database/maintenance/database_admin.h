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

/// The counts and sizes of a database's content; see DatabaseStats in admin_service.proto.
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

/// Copies one snapshot of the database into a new file (SQLite's online backup) while writers go
/// on, and checks the structure of the copy. Stops soon after `goes_on` has returned false. Errors:
/// Cancelled (stopped), ResourceExhausted (DATABASE_FULL), FailedPrecondition (DATABASE_UNUSABLE),
/// DataLoss (DATABASE_CORRUPT: the copy is damaged, usually because the database is).
absl::Status BackUp(Database& database, const std::filesystem::path& copy,
                    absl::FunctionRef<bool()> goes_on);

/// Takes the faults that a check finds, one line for each.
using OnFinding = std::function<void(const std::string& line)>;

/// The functions below work on a file that no daemon has open.

/// Checks SQLite's structure, every hash of every model, the digest of every mesh and every job.
/// Writes nothing but the newest schema. Errors: those of ModeDatabase::Open, and DataLoss
/// (DATABASE_CORRUPT) if the structure cannot be read.
absl::Status CheckDatabase(const std::filesystem::path& file, const OnFinding& on_finding);

/// Replaces the database by a copy, after a check of the copy: a file that BackUp made, or a
/// database that no program has open, with the log beside it. Returns the name under which the old
/// database is kept with its log, `file`.replaced or `file`.replaced-2 and so on, or an empty path
/// if there was none. A failed or killed restore leaves the old database in place or kept. Errors:
/// NotFound (FILE_NOT_FOUND), DataLoss (DATABASE_CORRUPT: damaged, or not a database of Carillon),
/// FailedPrecondition (SCHEMA_TOO_NEW; DATABASE_UNUSABLE: `copy` is the database itself),
/// ResourceExhausted (DATABASE_FULL).
absl::StatusOr<std::filesystem::path> RestoreDatabase(const std::filesystem::path& file,
                                                      const std::filesystem::path& copy);

}  // namespace carillon
