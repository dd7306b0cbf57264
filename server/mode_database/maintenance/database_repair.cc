// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include "absl/algorithm/container.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_contents.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/maintenance/database_replacement.h"
#include "server/mode_database/mesh_store.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/sqlite_connection.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {
namespace {

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
  ASSIGN_OR_RETURN(const auto clients, JobStore(from).Clients(digest));
  return JobStore(to).Put(*job, clients);
}

/// Whether an error says that the new database takes no row, rather than that a row is damaged.
bool EndsRepair(const absl::Status& status) {
  constexpr std::array<absl::string_view, 4> kReasons = {"DATABASE_FULL", "DATABASE_BUSY",
                                                         "DATABASE_LOST", "SERVER_OUT_OF_MEMORY"};
  return absl::c_linear_search(kReasons, ToErrorInfo(status).reason());
}

absl::Status CopyWhole(Database& from, Database& to, const OnFinding& on_finding) {
  struct Kind {
    const char* table;
    absl::Status (*copy)(Database&, Database&, const std::string&);
  };
  for (const Kind& kind :
       {Kind{"meshes", CopyMesh}, Kind{"models", CopyModel}, Kind{"jobs", CopyJob}}) {
    for (const std::string& digest : Names(from, kind.table, on_finding)) {
      absl::Status status = kind.copy(from, to, digest);
      if (EndsRepair(status)) return status;
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
  return error ? CannotMove(file, error) : absl::OkStatus();
}

absl::Status CopyToFresh(const std::filesystem::path& file, const std::filesystem::path& fresh,
                         const OnFinding& on_finding) {
  ASSIGN_OR_RETURN(const std::unique_ptr<Database> from, Database::Open(file));
  ASSIGN_OR_RETURN(const std::unique_ptr<Database> to, Database::Open(fresh));
  return CopyWhole(*from, *to, on_finding);
}

}  // namespace

absl::StatusOr<std::filesystem::path> RepairDatabase(const std::filesystem::path& file,
                                                     const OnFinding& on_finding) {
  ASSIGN_OR_RETURN(const std::filesystem::path real, FollowLinks(file));
  RETURN_IF_ERROR(CompleteReplacement(real));
  RemoveUnfinishedCopies(real);
  const std::filesystem::path fresh = UnfinishedCopy(real, "repair");
  RETURN_IF_ERROR(ExtendCutFile(real));
  if (absl::Status copied = CopyToFresh(real, fresh, on_finding); !copied.ok()) {
    RemoveDatabase(fresh);
    return copied;
  }
  return ReplaceDatabase(real, fresh, "damaged");
}

}  // namespace carillon
