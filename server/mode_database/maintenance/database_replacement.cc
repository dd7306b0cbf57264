// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/maintenance/database_replacement.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/algorithm/container.h"
#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {
namespace {

using std::filesystem::path;

/// A file that exists from the moment when the new database is whole on the disk until it has taken
/// its place. It has two lines: the names of the new database and of the kept one.
path MarkerOf(const path& file) { return file.string() + "-replacement"; }

/// Whether a database or a part of it has this name.
bool IsTaken(const path& name) {
  return absl::c_any_of(kContentSuffixes, [&](const char* suffix) {
    std::error_code ignored;
    return std::filesystem::exists(
        std::filesystem::symlink_status(name.string() + suffix, ignored));
  });
}

/// Checks that SQLite has copied the log of a closed database into its file, which it cannot on a
/// full disk, and that the file is whole.
absl::Status CheckIsWhole(const path& file) {
  std::error_code error;
  const uintmax_t left = std::filesystem::file_size(file.string() + "-wal", error);
  if (!error && left > 0) {
    return CannotMove(file, std::make_error_code(std::errc::no_space_on_device));
  }
  return SqliteConnection::CheckStructure(file, [] { return true; });
}

/// Waits until a file or folder is on the disk.
absl::Status Sync(const path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const absl::Cleanup close_it = [descriptor] { close(descriptor); };
  if (descriptor >= 0 && fsync(descriptor) == 0) return absl::OkStatus();
  return CannotMove(file, std::error_code(errno, std::generic_category()));
}

absl::Status Rename(const path& from, const path& to) {
  std::error_code error;
  std::filesystem::rename(from, to, error);
  return error ? CannotMove(to, error) : absl::OkStatus();
}

/// Gives a file a second name. Copies the file where the file system has no hard links.
absl::Status Link(const path& from, const path& to) {
  std::error_code error;
  if (std::filesystem::exists(to, error) || !std::filesystem::exists(from, error)) {
    return absl::OkStatus();
  }
  std::filesystem::create_hard_link(from, to, error);
  if (!error) return absl::OkStatus();
  const path part = to.string() + ".part";
  std::filesystem::copy_file(from, part, std::filesystem::copy_options::overwrite_existing, error);
  if (!error) return Rename(part, to);
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  return CannotMove(from, error);
}

/// Returns the first name for a kept database that nothing has.
path NewName(const path& file, const std::string& kind) {
  path name = file.string() + "." + kind;
  for (int number = 2; IsTaken(name); ++number) {
    name = absl::StrCat(file.string(), ".", kind, "-", number);
  }
  return name;
}

absl::Status WriteMarker(const path& file, const path& fresh, const path& kept) {
  const path part = MarkerOf(file).string() + ".part";
  std::ofstream marker(part);
  marker << fresh.filename().string() << '\n' << kept.filename().string() << '\n';
  marker.close();
  if (!marker) return CannotMove(part, std::error_code(errno, std::generic_category()));
  RETURN_IF_ERROR(Sync(part));
  RETURN_IF_ERROR(Rename(part, MarkerOf(file)));
  return Sync(file.parent_path());
}

/// Undoes what a replacement that cannot be completed has done before the new database took the
/// place of `file`.
void Undo(const path& file, const path& fresh, const path& kept) {
  for (const char* suffix : {"-wal", "-count"}) {
    if (!Link(kept.string() + suffix, file.string() + suffix).ok()) return;
  }
  std::error_code ignored;
  const path marker = MarkerOf(file);
  for (const path& left : {marker, path(marker.string() + ".part")}) {
    std::filesystem::remove(left, ignored);
  }
  RemoveDatabase(kept);
  RemoveDatabase(fresh);
}

absl::Status Begin(const path& file, const path& fresh, const path& kept) {
  RETURN_IF_ERROR(CheckIsWhole(fresh));
  RETURN_IF_ERROR(Sync(fresh));
  return WriteMarker(file, fresh, kept);
}

}  // namespace

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

void RemoveDatabase(const path& file) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm", "-count", "-lost"}) {
    std::filesystem::remove(file.string() + suffix, ignored);
  }
}

absl::Status CompleteReplacement(const path& file) {
  std::ifstream marker(MarkerOf(file));
  std::string fresh_name;
  std::string kept_name;
  if (!std::getline(marker, fresh_name) || !std::getline(marker, kept_name)) {
    return absl::OkStatus();
  }
  const path fresh = file.parent_path() / fresh_name;
  const path kept = file.parent_path() / kept_name;
  std::error_code ignored;
  // Each step may have been done before.
  if (std::filesystem::exists(fresh, ignored)) {
    for (const char* suffix : kContentSuffixes) {
      RETURN_IF_ERROR(Link(file.string() + suffix, kept.string() + suffix));
    }
    // The log and the count of the old database must not be taken for those of the new one.
    for (const char* suffix : {"-wal", "-count", "-shm"}) {
      const path companion = file.string() + suffix;
      std::error_code error;
      std::filesystem::remove(companion, error);
      if (error) return CannotMove(companion, error);
    }
    RETURN_IF_ERROR(Rename(fresh, file));
  }
  const path fresh_count = fresh.string() + "-count";
  if (std::filesystem::exists(fresh_count, ignored)) {
    RETURN_IF_ERROR(Rename(fresh_count, file.string() + "-count"));
  }
  RETURN_IF_ERROR(Sync(file.parent_path()));
  LossMark(file).Remove();
  std::filesystem::remove(MarkerOf(file), ignored);
  return absl::OkStatus();
}

absl::StatusOr<path> ReplaceDatabase(const path& file, const path& fresh, const std::string& kind) {
  const bool existed = IsTaken(file);
  const path kept = NewName(file, kind);
  absl::Status status = Begin(file, fresh, kept);
  if (status.ok()) status = CompleteReplacement(file);
  if (status.ok()) return existed ? kept : path();
  std::error_code ignored;
  if (std::filesystem::exists(fresh, ignored)) Undo(file, fresh, kept);
  return status;
}

}  // namespace carillon
