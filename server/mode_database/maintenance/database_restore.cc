// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {
namespace {

using std::filesystem::path;

absl::Status Corrupt(const path& copy, absl::string_view why) {
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT", absl::StrCat(copy.string(), why));
}

absl::Status CannotMove(const path& file, const std::error_code& error) {
  if (error == std::errc::no_space_on_device || error == std::errc::file_too_large) {
    return Refusal(absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
                   absl::StrCat("no space is left for ", file.string(),
                                ": free some on its disk, and try again"));
  }
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat(file.string(), " cannot be copied or replaced (", error.message(),
                              "): see that this user may read it, and write in the data folder"));
}

/// Removes a database with its log and the index of the log. It is no error if there is none.
void RemoveDatabase(const path& file) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) {
    std::filesystem::remove(file.string() + suffix, ignored);
  }
}

/// Checks that the copy may take the place of `file`.
absl::Status CheckIsAnother(const path& file, const path& copy) {
  std::error_code ignored;
  if (!std::filesystem::exists(copy, ignored)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("there is no file ", copy.string(),
                                ", or this user may not see it: name a backup"));
  }
  for (const path& own : {file, UnfinishedCopy(file, "restore")}) {
    if (!std::filesystem::equivalent(copy, own, ignored)) continue;
    return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                   absl::StrCat(copy.string(), " is ", own.string(),
                                ", which the restore would replace: name a backup"));
  }
  return absl::OkStatus();
}

absl::Status CopyFile(const path& from, const path& to) {
  std::error_code error;
  std::filesystem::copy_file(from, to, error);
  // The library reports a disk that becomes full amid a copy as an error of the disk.
  std::error_code ignored;
  if (error == std::errc::io_error && std::filesystem::space(to.parent_path(), ignored).available <
                                          std::filesystem::file_size(from, ignored)) {
    error = std::make_error_code(std::errc::no_space_on_device);
  }
  return error ? CannotMove(from, error) : absl::OkStatus();
}

/// Copies a database with its write-ahead log, which has its newest changes.
absl::Status CopyWithLog(const path& from, const path& to) {
  std::error_code ignored;
  RETURN_IF_ERROR(CopyFile(from, to));
  const bool has_log = std::filesystem::exists(LogOf(from), ignored);
  return has_log ? CopyFile(LogOf(from), LogOf(to)) : absl::OkStatus();
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

/// Checks that SQLite has copied the log of a closed database into its file, which it cannot on a
/// full disk and then says nothing.
absl::Status CheckHasNoLog(const path& file) {
  std::error_code error;
  const uintmax_t left = std::filesystem::file_size(LogOf(file), error);
  if (error || left == 0) return absl::OkStatus();
  return CannotMove(file, std::make_error_code(std::errc::no_space_on_device));
}

absl::Status CheckCopy(const path& file, const path& copy) {
  RETURN_IF_ERROR(CheckHasTables(file, copy));
  std::string first_finding;
  RETURN_IF_ERROR(CheckDatabase(file, [&](const std::string& line) {
    if (first_finding.empty()) first_finding = line;
  }));
  if (first_finding.empty()) return CheckHasNoLog(file);
  return Corrupt(copy,
                 absl::StrCat(" is damaged (",
                              absl::StrReplaceAll(first_finding, {{file.string(), copy.string()}}),
                              "): take an older copy"));
}

/// Waits until a file or folder is on the disk.
absl::Status Sync(const path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const absl::Cleanup close_it = [descriptor] { close(descriptor); };
  if (descriptor >= 0 && fsync(descriptor) == 0) return absl::OkStatus();
  return CannotMove(file, std::error_code(errno, std::generic_category()));
}

/// Whether a database or its log has this name.
bool IsTaken(const path& file) {
  std::error_code ignored;
  return std::filesystem::exists(std::filesystem::symlink_status(file, ignored)) ||
         std::filesystem::exists(std::filesystem::symlink_status(LogOf(file), ignored));
}

/// Returns the first name for the old database that nothing has.
path NewName(const path& file) {
  path name = file.string() + ".replaced";
  for (int number = 2; IsTaken(name); ++number) {
    name = absl::StrCat(file.string(), ".replaced-", number);
  }
  return name;
}

/// Gives a file a second name. Copies the file where the file system has no hard links.
absl::Status Link(const path& from, const path& to) {
  std::error_code error;
  if (!std::filesystem::exists(from, error)) return absl::OkStatus();
  std::filesystem::create_hard_link(from, to, error);
  return error ? CopyFile(from, to) : absl::OkStatus();
}

/// Keeps the old database with its log under the name `kept`, and puts `fresh` in its place. The
/// rename comes last, so that a killed program leaves a database under the name `file`.
absl::Status Replace(const path& file, const path& fresh, const path& kept) {
  RETURN_IF_ERROR(Sync(fresh));
  RETURN_IF_ERROR(Link(file, kept));
  RETURN_IF_ERROR(Link(LogOf(file), LogOf(kept)));
  RETURN_IF_ERROR(Sync(file.parent_path()));
  // SQLite would take the log of the old database for that of the new one.
  std::error_code error;
  for (const path& stale : {LogOf(file), path(file.string() + "-shm")}) {
    std::filesystem::remove(stale, error);
    if (error) return CannotMove(stale, error);
  }
  std::filesystem::rename(fresh, file, error);
  return error ? CannotMove(file, error) : absl::OkStatus();
}

/// Undoes what a Replace that has failed has done.
void Undo(const path& file, const path& kept) {
  std::error_code ignored;
  const bool has_log = std::filesystem::exists(LogOf(file), ignored);
  if (has_log || Link(LogOf(kept), LogOf(file)).ok()) RemoveDatabase(kept);
}

}  // namespace

absl::StatusOr<path> RestoreDatabase(const path& file, const path& copy) {
  ASSIGN_OR_RETURN(const path real, FollowLinks(file));
  std::error_code error;
  // The copy's log is beside the file to which a link leads.
  path source = std::filesystem::weakly_canonical(copy, error);
  if (error) source = copy;
  RETURN_IF_ERROR(CheckIsAnother(real, source));
  RemoveUnfinishedCopies(real);
  std::filesystem::create_directories(real.parent_path(), error);
  const path fresh = UnfinishedCopy(real, "restore");
  const absl::Cleanup remove_rest = [&] { RemoveDatabase(fresh); };
  RETURN_IF_ERROR(CopyWithLog(source, fresh));
  RETURN_IF_ERROR(CheckCopy(fresh, source));
  const path kept = NewName(real);
  const bool existed = IsTaken(real);
  absl::Status replaced = Replace(real, fresh, kept);
  if (!replaced.ok()) {
    Undo(real, kept);
    return replaced;
  }
  RETURN_IF_ERROR(Sync(real.parent_path()));
  return existed ? kept : path();
}

}  // namespace carillon
