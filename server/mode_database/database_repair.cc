// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
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
#include "server/mode_database/database_replacement.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mesh_store.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/sqlite_connection.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {
namespace {

absl::Status CannotCopy(const std::filesystem::path& file, const std::error_code& error) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat(file.string(), " cannot be copied (", error.message(),
                              "): see that this user may read it, and write in the data folder"));
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
      if (status.ok()) continue;
      on_finding(absl::StrCat("left out of ", kind.table, ": ", digest, ": ",
                              std::string(status.message())));
    }
  }
  return absl::OkStatus();
}

/// Appends zeros to a file that somebody has cut short, because SQLite reads nothing of such a
/// file. The pages that are lost are then found damaged, and all others are kept.
absl::Status ExtendCutFile(const std::filesystem::path& file) {
  const auto number = [](std::span<const unsigned char> bytes) {
    uint64_t value = 0;
    for (const unsigned char byte : bytes) value = value << 8U | byte;
    return value;
  };
  std::error_code error;
  std::array<unsigned char, 32> header{};
  std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(header.data()), header.size());
  // https://www.sqlite.org/fileformat.html#the_database_header: the page size, where 1 stands for
  // 65,536, and the number of pages.
  const uint64_t page_field = number(std::span(header).subspan(16, 2));
  const uint64_t page_count = number(std::span(header).subspan(28, 4));
  const uint64_t whole = (page_field == 1 ? 65'536 : page_field) * page_count;
  const uint64_t size = std::filesystem::file_size(file, error);
  if (error || size < header.size() || size >= whole) return absl::OkStatus();
  std::filesystem::resize_file(file, whole, error);
  return error ? CannotCopy(file, error) : absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::filesystem::path> RepairDatabase(const std::filesystem::path& file,
                                                     const OnFinding& on_finding) {
  RETURN_IF_ERROR(CompleteReplacement(file));
  const std::filesystem::path fresh = file.string() + ".repaired";
  Remove(fresh);
  RETURN_IF_ERROR(ExtendCutFile(file));
  {
    ASSIGN_OR_RETURN(const std::unique_ptr<Database> from, Database::Open(file));
    ASSIGN_OR_RETURN(const std::unique_ptr<Database> to, Database::Open(fresh));
    RETURN_IF_ERROR(CopyWhole(*from, *to, on_finding));
  }
  return ReplaceDatabase(file, fresh, "damaged");
}

absl::StatusOr<std::filesystem::path> RestoreDatabase(const std::filesystem::path& file,
                                                      const std::filesystem::path& copy) {
  RETURN_IF_ERROR(CompleteReplacement(file));
  std::error_code error;
  const std::filesystem::path incoming = file.string() + ".incoming";
  Remove(incoming);
  if (!std::filesystem::exists(copy, error)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("there is no file ", copy.string(),
                                ", or this user may not see it: name a backup"));
  }
  std::filesystem::create_directories(std::filesystem::absolute(file).parent_path(), error);
  std::filesystem::copy_file(copy, incoming, error);
  if (error) return CannotCopy(copy, error);
  std::string first_finding;
  absl::Status status = CheckDatabase(incoming, [&](const std::string& line) {
    if (first_finding.empty()) first_finding = line;
  });
  if (status.ok() && !first_finding.empty()) {
    status = Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                     absl::StrCat(copy.string(), " is damaged (", first_finding,
                                  "): take an older copy, or repair this one first"));
  }
  if (status.ok()) return ReplaceDatabase(file, incoming, "replaced");
  Remove(incoming);
  return status;
}

}  // namespace carillon
