// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// Brings the schema of an open transaction up to date, version by version (PRAGMA user_version).
/// Errors: FailedPrecondition (SCHEMA_TOO_NEW: written by a newer Carillon).
absl::Status Migrate(SqliteConnection& connection);

}  // namespace carillon
