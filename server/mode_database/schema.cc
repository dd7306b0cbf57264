// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/schema.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

// Element v - 1 leads from version v - 1 to v. A released migration is never edited: changes are
// appended.
//
// Every hash is an XXH3 whose 64 bits are stored as a signed integer. Blobs are the last columns,
// so that the columns before them are read without them. The hash of a job covers its whole row and
// is NULL if an older program wrote it.
constexpr std::array kMigrations = {R"sql(
  CREATE TABLE meshes (
    digest TEXT PRIMARY KEY,
    byte_count INTEGER NOT NULL
  ) STRICT;
  CREATE TABLE mesh_chunks (
    digest TEXT NOT NULL REFERENCES meshes ON DELETE CASCADE,
    byte_offset INTEGER NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (digest, byte_offset)
  ) STRICT;
  CREATE TABLE models (
    revision INTEGER PRIMARY KEY AUTOINCREMENT,
    digest TEXT NOT NULL UNIQUE,
    label TEXT NOT NULL,
    stored_bytes INTEGER NOT NULL,
    created_unix_ms INTEGER NOT NULL,
    header_xxh3 INTEGER NOT NULL,
    header BLOB NOT NULL
  ) STRICT;
  CREATE TABLE model_chunks (
    revision INTEGER NOT NULL REFERENCES models ON DELETE CASCADE,
    number INTEGER NOT NULL,
    array INTEGER NOT NULL,
    byte_offset INTEGER NOT NULL,
    xxh3 INTEGER NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (revision, number)
  ) STRICT;
  CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    digest TEXT NOT NULL UNIQUE,
    label TEXT NOT NULL,
    state INTEGER NOT NULL,
    remembered INTEGER NOT NULL,
    created_unix_ms INTEGER NOT NULL,
    error BLOB NOT NULL,
    request BLOB NOT NULL
  ) STRICT;
  CREATE INDEX jobs_by_state ON jobs (state);
)sql",
                                    R"sql(
  ALTER TABLE models ADD COLUMN quarantined INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE models ADD COLUMN pinned INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE models ADD COLUMN sounded_unix_ms INTEGER NOT NULL DEFAULT 0;
  CREATE TABLE model_tags (
    tag TEXT NOT NULL,
    digest TEXT NOT NULL,
    PRIMARY KEY (tag, digest)
  ) STRICT, WITHOUT ROWID;
  CREATE INDEX model_tags_by_digest ON model_tags (digest);
  ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN start_count INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN way INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN peak_bytes INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN xxh3 INTEGER;
  DROP INDEX jobs_by_state;
  CREATE TABLE facts (
    name TEXT PRIMARY KEY,
    value TEXT NOT NULL
  ) STRICT, WITHOUT ROWID;
)sql",
                                    R"sql(
  ALTER TABLE meshes ADD COLUMN uploaded_unix_ms INTEGER NOT NULL DEFAULT 0;
)sql",
                                    R"sql(
  CREATE TABLE transfers (
    revision INTEGER NOT NULL REFERENCES models ON DELETE CASCADE,
    speed INTEGER NOT NULL,
    stored_bytes INTEGER NOT NULL,
    created_unix_ms INTEGER NOT NULL,
    header_xxh3 INTEGER NOT NULL,
    xxh3 INTEGER NOT NULL,
    header BLOB NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (revision, speed)
  ) STRICT;
  ALTER TABLE jobs ADD COLUMN transfer_of TEXT NOT NULL DEFAULT '';
)sql",
                                    R"sql(
  CREATE TABLE model_materials (
    digest TEXT PRIMARY KEY,
    xxh3 INTEGER NOT NULL,
    material BLOB NOT NULL
  ) STRICT, WITHOUT ROWID;
)sql",
                                    R"sql(
  CREATE TABLE job_clients (
    digest TEXT NOT NULL REFERENCES jobs (digest) ON DELETE CASCADE,
    client TEXT NOT NULL,
    PRIMARY KEY (digest, client)
  ) STRICT, WITHOUT ROWID;
)sql"};

absl::StatusOr<int64_t> Version(SqliteConnection& connection) {
  int64_t version = 0;
  RETURN_IF_ERROR(connection.Query("PRAGMA user_version", {}, [&](const SqlRow& row) {
    version = row.Int(0);
    return absl::OkStatus();
  }));
  return version;
}

}  // namespace

absl::Status Migrate(SqliteConnection& connection) {
  ASSIGN_OR_RETURN(const int64_t version, Version(connection));
  constexpr auto kNewest = static_cast<int64_t>(kMigrations.size());
  if (version > kNewest) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "SCHEMA_TOO_NEW",
                   absl::StrCat("the database has schema version ", version,
                                ", this program knows versions up to ", kNewest,
                                ": install the newer Carillon, or name another folder"));
  }
  for (int64_t v = version; v < kNewest; ++v) {
    absl::Status status = connection.RunScript(kMigrations[static_cast<size_t>(v)]);
    if (status.ok()) {
      status = connection.RunScript(absl::StrCat("PRAGMA user_version = ", v + 1).c_str());
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace carillon
