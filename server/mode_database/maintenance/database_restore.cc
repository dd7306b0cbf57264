// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/maintenance/database_replacement.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {
namespace {

using std::filesystem::path;

absl::Status Corrupt(const path& copy, absl::string_view why) {
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT", absl::StrCat(copy.string(), why));
}

/// Checks that the copy may take the place of `file`.
absl::Status CheckIsAnother(const path& file, const path& copy) {
  std::error_code ignored;
  if (!std::filesystem::exists(copy, ignored)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("there is no file ", copy.string(),
                                ", or this user may not see it: name a backup"));
  }
  for (const path& own : {file, UnfinishedCopy(file, "restore"), UnfinishedCopy(file, "repair")}) {
    if (!std::filesystem::equivalent(copy, own, ignored)) continue;
    return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                   absl::StrCat(copy.string(), " is ", own.string(),
                                ", which the restore would replace: name a backup"));
  }
  return absl::OkStatus();
}

/// Copies a database with its write-ahead log, which has its newest changes, and the count of them.
absl::Status CopyFiles(const path& from, const path& to) {
  for (const char* suffix : kContentSuffixes) {
    const path part = from.string() + suffix;
    std::error_code error;
    if (!std::filesystem::exists(part, error)) continue;
    std::filesystem::copy_file(part, to.string() + suffix, error);
    // The library reports a disk that becomes full amid a copy as an error of the disk.
    std::error_code ignored;
    if (error == std::errc::io_error &&
        std::filesystem::space(to.parent_path(), ignored).available <
            std::filesystem::file_size(part, ignored)) {
      error = std::make_error_code(std::errc::no_space_on_device);
    }
    if (error) return CannotMove(part, error);
  }
  return absl::OkStatus();
}

/// Checks that a file has Carillon's tables, before they are made in it. `copy` names the file in
/// the error.
absl::Status CheckHasTables(const path& file, const path& copy) {
  int64_t table_count = 0;
  const auto count = [&](const SqlRow& row) {
    table_count = row.Int(0);
    return absl::OkStatus();
  };
  absl::Status status = [&] {
    ASSIGN_OR_RETURN(const auto connection, SqliteConnection::Open(file));
    return connection->Query(
        "SELECT count(*) FROM sqlite_schema WHERE name IN ('jobs', 'meshes', 'models')", {}, count);
  }();
  if (status.ok() && table_count == 3) return status;
  if (!status.ok() && !absl::IsDataLoss(status)) return status;
  return Corrupt(copy, " is not a database of Carillon: name a file that carillon db backup made");
}

absl::Status CheckCopy(const path& file, const path& copy) {
  RETURN_IF_ERROR(CheckHasTables(file, copy));
  std::string first_finding;
  RETURN_IF_ERROR(CheckDatabase(file, [&](const std::string& line) {
    if (first_finding.empty()) first_finding = line;
  }));
  if (first_finding.empty()) return absl::OkStatus();
  return Corrupt(copy,
                 absl::StrCat(" is damaged (",
                              absl::StrReplaceAll(first_finding, {{file.string(), copy.string()}}),
                              "): take an older copy, or repair this one first"));
}

}  // namespace

absl::StatusOr<path> RestoreDatabase(const path& file, const path& copy) {
  ASSIGN_OR_RETURN(const path real, FollowLinks(file));
  RETURN_IF_ERROR(CompleteReplacement(real));
  std::error_code error;
  // The copy's log is beside the file to which a link leads.
  path source = std::filesystem::weakly_canonical(copy, error);
  if (error) source = copy;
  RETURN_IF_ERROR(CheckIsAnother(real, source));
  RemoveUnfinishedCopies(real);
  std::filesystem::create_directories(real.parent_path(), error);
  const path incoming = UnfinishedCopy(real, "restore");
  absl::Status status = CopyFiles(source, incoming);
  if (status.ok()) status = CheckCopy(incoming, source);
  if (status.ok()) return ReplaceDatabase(real, incoming, "replaced");
  RemoveDatabase(incoming);
  return status;
}

}  // namespace carillon
