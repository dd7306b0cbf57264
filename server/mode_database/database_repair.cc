// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <string_view>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_admin.h"
#include "server/mode_database/database_contents.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mesh_store.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/sqlite_connection.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {
namespace {

absl::Status CannotMove(const std::filesystem::path& file, const std::error_code& error) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat(file.string(), " cannot be moved or copied (", error.message(),
                              "): see that this user may write in its folder"));
}

// Moves the database file, its write-ahead log and its count of changes, if there are any.
absl::Status Move(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  for (const char* suffix : {"", "-wal", "-count"}) {
    const std::filesystem::path source = from.string() + suffix;
    if (std::filesystem::exists(source)) {
      std::filesystem::rename(source, to.string() + suffix, error);
      if (error) return CannotMove(source, error);
    } else {
      std::filesystem::remove(to.string() + suffix, error);
    }
  }
  std::filesystem::remove(from.string() + "-shm", error);
  return absl::OkStatus();
}

void Remove(const std::filesystem::path& file) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm", "-count"}) {
    std::filesystem::remove(file.string() + suffix, ignored);
  }
}

// Transfers that have changed on the disk are left out: they can be computed again.
absl::Status CopyTransfers(Database& from, Database& to, const std::string& model_digest) {
  const SystemClock clock;
  ASSIGN_OR_RETURN(const auto transfers, TransferStore(from, clock).Read(model_digest));
  TransferStore target(to, clock);
  for (const StoredTransfer& transfer : transfers) {
    RETURN_IF_ERROR(target.Put(model_digest, transfer).status());
  }
  return absl::OkStatus();
}

absl::Status CopyModel(Database& from, Database& to, const std::string& digest) {
  const SystemClock clock;
  ModelStore source(from, clock);
  ModelStore target(to, clock);
  ASSIGN_OR_RETURN(ModelExport records, source.Export(digest));
  ASSIGN_OR_RETURN(const ModelSummary summary, source.Summary(digest));
  ASSIGN_OR_RETURN(ModelImport copy, target.Import(digest, summary.label));
  while (true) {
    ASSIGN_OR_RETURN(const auto record, records.Next());
    if (!record.has_value()) break;
    RETURN_IF_ERROR(copy.Append(*record));
  }
  if (const auto stored = copy.Finish(); !stored.ok()) return stored.status();
  RETURN_IF_ERROR(target
                      .Update(digest, {.add_tags = summary.tags,
                                       .pinned = summary.pinned,
                                       .material = summary.material})
                      .status());
  RETURN_IF_ERROR(CopyTransfers(from, to, digest));
  return to.Write([&](SqliteConnection& connection) {
    return connection.Run(
        "UPDATE models SET created_unix_ms = ?, sounded_unix_ms = ? WHERE digest = ?",
        {summary.created_unix_ms, summary.sounded_unix_ms, digest});
  });
}

absl::Status CopyMesh(Database& from, Database& to, const std::string& digest) {
  Sha256 sha;
  absl::Status status = ReadMesh(from, digest, [&](std::string_view bytes) {
    sha.Update(bytes);
    return absl::OkStatus();
  });
  if (!status.ok() || sha.Finish() != digest) {
    return Refusal(absl::StatusCode::kDataLoss, "MESH_CORRUPT",
                   absl::StrCat("the mesh ", digest, " has changed on the disk: upload it again"));
  }
  const SystemClock clock;
  MeshStore meshes(to, clock);
  ASSIGN_OR_RETURN(MeshUpload copy, meshes.Begin());
  status = ReadMesh(from, digest, [&](std::string_view bytes) { return copy.Append(bytes); });
  return status.ok() ? copy.Finish().status() : status;
}

absl::Status CopyJob(Database& from, Database& to, const std::string& digest) {
  ASSIGN_OR_RETURN(const auto job, JobStore(from).Find(digest));
  if (!job.has_value()) return absl::OkStatus();
  if (job->damaged) return FromErrorInfo(absl::StatusCode::kDataLoss, job->error);
  return JobStore(to).Put(*job);
}

// A full disk ends the repair; a damaged row is only left out.
absl::Status CopyWhole(Database& from, Database& to, const OnFinding& on_finding) {
  struct Kind {
    const char* table;
    absl::Status (*copy)(Database&, Database&, const std::string&);
  };
  for (const Kind& kind :
       {Kind{"meshes", CopyMesh}, Kind{"models", CopyModel}, Kind{"jobs", CopyJob}}) {
    for (const std::string& digest : Names(from, kind.table, on_finding)) {
      absl::Status status = kind.copy(from, to, digest);
      if (absl::IsResourceExhausted(status)) return status;
      if (!status.ok()) on_finding(absl::StrCat("left out: ", std::string(status.message())));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RepairDatabase(const std::filesystem::path& file, const OnFinding& on_finding) {
  const std::filesystem::path fresh = file.string() + ".repaired";
  Remove(fresh);
  {
    ASSIGN_OR_RETURN(const std::unique_ptr<Database> from, Database::Open(file));
    ASSIGN_OR_RETURN(const std::unique_ptr<Database> to, Database::Open(fresh));
    RETURN_IF_ERROR(CopyWhole(*from, *to, on_finding));
  }
  RETURN_IF_ERROR(Move(file, file.string() + ".damaged"));
  return Move(fresh, file);
}

absl::Status RestoreDatabase(const std::filesystem::path& file, const std::filesystem::path& copy) {
  std::error_code error;
  const std::filesystem::path incoming = file.string() + ".incoming";
  Remove(incoming);
  if (!std::filesystem::exists(copy)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("there is no file ", copy.string(), ": name a backup"));
  }
  std::filesystem::create_directories(std::filesystem::absolute(file).parent_path(), error);
  std::filesystem::copy_file(copy, incoming, error);
  if (error) return CannotMove(copy, error);
  std::string first_finding;
  absl::Status status = CheckDatabase(incoming, [&](const std::string& line) {
    if (first_finding.empty()) first_finding = line;
  });
  if (status.ok() && !first_finding.empty()) {
    status = Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                     absl::StrCat(copy.string(), " is damaged (", first_finding,
                                  "): take an older copy, or repair this one first"));
  }
  if (status.ok() && std::filesystem::exists(file)) {
    status = Move(file, file.string() + ".replaced");
  }
  if (status.ok()) status = Move(incoming, file);
  if (!status.ok()) Remove(incoming);
  return status;
}

}  // namespace carillon
