// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/maintenance/database_admin.h"

#include <memory>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/status_macros.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/sqlite_connection.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {
namespace {

absl::Status Count(SqliteConnection& connection, const char* sql,
                   std::initializer_list<uint64_t*> columns) {
  return connection.Query(sql, {}, [&](const SqlRow& row) {
    int column = 0;
    for (uint64_t* target : columns) *target = static_cast<uint64_t>(row.Int(column++));
    return absl::OkStatus();
  });
}

absl::Status CountRows(SqliteConnection& connection, DatabaseStats& stats) {
  absl::Status status =
      Count(connection,
            "SELECT count(*), coalesce(sum(stored_bytes), 0) FROM models WHERE quarantined = 0",
            {&stats.model_count, &stats.model_bytes});
  if (status.ok()) {
    status = Count(connection, "SELECT count(*) FROM models WHERE quarantined = 1",
                   {&stats.quarantined_count});
  }
  if (status.ok()) {
    status = Count(connection, "SELECT count(*), coalesce(sum(byte_count), 0) FROM meshes",
                   {&stats.mesh_count, &stats.mesh_bytes});
  }
  if (status.ok()) {
    status = Count(connection, "SELECT count(*), coalesce(sum(state IN (1, 2)), 0) FROM jobs",
                   {&stats.job_count, &stats.unfinished_job_count});
  }
  return status;
}

absl::Status CountPages(SqliteConnection& connection, DatabaseStats& stats) {
  uint64_t page_bytes = 0;
  uint64_t version = 0;
  absl::Status status = Count(connection, "PRAGMA page_size", {&page_bytes});
  if (status.ok()) status = Count(connection, "PRAGMA page_count", {&stats.file_bytes});
  if (status.ok()) status = Count(connection, "PRAGMA freelist_count", {&stats.free_bytes});
  if (status.ok()) status = Count(connection, "PRAGMA user_version", {&version});
  stats.file_bytes *= page_bytes;
  stats.free_bytes *= page_bytes;
  stats.schema_version = static_cast<uint32_t>(version);
  return status;
}

absl::Status CheckStructure(Database& database, const OnFinding& on_finding) {
  return database.Read([&](SqliteConnection& connection) {
    return connection.Query("PRAGMA integrity_check", {}, [&](const SqlRow& row) {
      // The first row begins with a line that names the database, and has one line for each page.
      for (const absl::string_view line : absl::StrSplit(row.Text(0), '\n')) {
        if (line == "ok" || absl::StartsWith(line, "***")) continue;
        on_finding(absl::StrCat("structure: ", line));
      }
      return absl::OkStatus();
    });
  });
}

/// Returns the digests in `table` as far as they can be read. An error is a finding.
std::vector<std::string> DigestsIn(Database& database, const std::string& table,
                                   const OnFinding& on_finding) {
  std::vector<std::string> digests;
  const absl::Status status = database.Read([&](SqliteConnection& connection) {
    return connection.Query(absl::StrCat("SELECT digest FROM ", table, " ORDER BY rowid").c_str(),
                            {}, [&](const SqlRow& row) {
                              digests.push_back(row.Text(0));
                              return absl::OkStatus();
                            });
  });
  if (!status.ok()) on_finding(absl::StrCat(table, ": ", status.message()));
  return digests;
}

absl::Status CheckModels(Database& database, const OnFinding& on_finding) {
  for (const std::string& digest : DigestsIn(database, "models", on_finding)) {
    const absl::Status status = database.Read([&](SqliteConnection& connection) {
      const absl::StatusOr<ModelSummary> summary = SelectModel(connection, digest);
      return summary.ok() ? ReadModel(connection, *summary).status() : summary.status();
    });
    if (!status.ok()) on_finding(std::string(status.message()));
  }
  return absl::OkStatus();
}

absl::Status CheckTransfers(Database& database, const OnFinding& on_finding) {
  const SystemClock clock;
  TransferStore transfers(database, clock);
  for (const std::string& digest : DigestsIn(database, "models", on_finding)) {
    uint64_t row_count = 0;
    const absl::Status counted = database.Read([&](SqliteConnection& connection) {
      return connection.Query(
          "SELECT count(*) FROM transfers JOIN models USING (revision) WHERE digest = ?", {digest},
          [&](const SqlRow& row) {
            row_count = static_cast<uint64_t>(row.Int(0));
            return absl::OkStatus();
          });
    });
    if (counted.ok() && row_count == 0) continue;
    const auto whole = transfers.Read(digest);
    if (!counted.ok() || !whole.ok() || whole->size() != row_count) {
      on_finding(absl::StrCat("a transfer of modalModels/", digest, " has changed on the disk"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckMeshes(Database& database, const OnFinding& on_finding) {
  for (const std::string& digest : DigestsIn(database, "meshes", on_finding)) {
    Sha256 sha;
    const absl::Status status = database.Read([&](SqliteConnection& connection) {
      return connection.Query("SELECT data FROM mesh_chunks WHERE digest = ? ORDER BY byte_offset",
                              {digest}, [&](const SqlRow& row) {
                                sha.Update(row.Blob(0));
                                return absl::OkStatus();
                              });
    });
    if (!status.ok() || sha.Finish() != digest) {
      on_finding(absl::StrCat("the mesh ", digest, " has changed on the disk"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckJobs(Database& database, const OnFinding& on_finding) {
  JobStore jobs(database);
  for (const std::string& digest : DigestsIn(database, "jobs", on_finding)) {
    const auto job = jobs.Find(digest);
    if (!job.ok()) {
      on_finding(std::string(job.status().message()));
    } else if (job->has_value() && (*job)->damaged) {
      on_finding((*job)->error.message());
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<DatabaseStats> ReadStats(Database& database) {
  DatabaseStats stats;
  RETURN_IF_ERROR(database.Read([&](SqliteConnection& connection) {
    absl::Status counted = CountRows(connection, stats);
    return counted.ok() ? CountPages(connection, stats) : counted;
  }));
  return stats;
}

absl::Status BackUp(Database& database, const std::filesystem::path& copy,
                    absl::FunctionRef<bool()> goes_on) {
  RETURN_IF_ERROR(database.Read(
      [&](SqliteConnection& connection) { return connection.BackUpTo(copy, goes_on); }));
  return SqliteConnection::CheckStructure(copy, goes_on);
}

absl::Status CheckDatabase(const std::filesystem::path& file, const OnFinding& on_finding) {
  ASSIGN_OR_RETURN(const std::unique_ptr<Database> database, Database::Open(file));
  for (const auto check : {CheckStructure, CheckModels, CheckTransfers, CheckMeshes, CheckJobs}) {
    RETURN_IF_ERROR(check(*database, on_finding));
  }
  return absl::OkStatus();
}

}  // namespace carillon
