// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/spool_file.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// The SQLite file with its schema. There is one writer at a time; each reader has its own
/// connection. Safe from every thread.
class Database {
 public:
  /// Opens the file. See ModeDatabase::Open.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::filesystem::path& file);

  /// Runs `body` in one transaction. The transaction is committed and on the disk when Write
  /// returns OK, and rolled back if `body` fails. If the disk is full and MakeSpace frees some
  /// space, runs `body` again from its beginning. Waits for other changes, and up to 10 s after the
  /// call for a lock that another process holds.
  absl::Status Write(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// Runs `body` in one transaction, as Write does. `body` must be a change that frees space. If
  /// the disk is full, makes room for the change and runs `body` again.
  absl::Status WriteToFree(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// Returns OK if the database can be changed, as far as is known without a change. Errors:
  /// FailedPrecondition (DATABASE_LOST: the file is not in place; after this error every Write
  /// fails with DATABASE_LOST), and the error of the last change if other changes would probably
  /// meet it too: DATABASE_FULL, DATABASE_BUSY, DATABASE_IO_ERROR or DATABASE_CORRUPT.
  absl::Status CheckState();

  /// Returns what CheckState returns. If the last change failed, first makes a small change to see
  /// whether the database can be changed again.
  absl::Status TryAgain();

  /// Copies the log into the file, as far as no reader needs it. An error shows at the next change.
  void CopyLog();

  /// Gives some free pages back to the disk if at least a quarter of the file is free, and renews
  /// the reserve for a full disk. A file that an older program made does not shrink.
  absl::Status Tidy();

  /// Gives free pages, at most 64 MiB, and the space of the log back to the disk at once if at
  /// least a quarter of the file is free. It is for a disk that is full; Tidy gives free pages back
  /// little by little. Takes the reserve if the log cannot be emptied without it. Returns whether
  /// the files shrank.
  bool MakeSpace();

  /// Makes a temporary file in the folder of the database. The file calls MakeSpace when the disk
  /// is full. Errors: DATABASE_LOST, and those of SpoolFile::Make.
  absl::StatusOr<SpoolFile> MakeSpool();

  /// Runs `body` on one snapshot of the database.
  absl::Status Read(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// The folder, on the same disk, for files that wait for a transaction.
  std::filesystem::path folder() const { return file_.parent_path(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  explicit Database(std::filesystem::path file)
      : file_(std::move(file)), watch_(file_), reserve_(file_) {}

  absl::Status ConnectWriter();

  /// Looks at the file, runs `work`, which may change it, and looks at it again. Each change must
  /// be made here. Errors: DATABASE_LOST, or the work's error.
  absl::Status Change(absl::FunctionRef<absl::Status()> work)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_mutex_);
  absl::Status CheckSize() ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_mutex_);
  absl::Status WriteLocked(absl::FunctionRef<absl::Status(SqliteConnection&)> body)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_mutex_);
  void RememberFailure(const absl::Status& status);
  bool MakeSpaceLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_mutex_);
  absl::StatusOr<std::unique_ptr<SqliteConnection>> TakeReader();

  const std::filesystem::path file_;
  FileWatch watch_;
  const DiskReserve reserve_;
  Mutex writer_mutex_;
  /// Size of the file after the last change. A smaller file was truncated.
  uintmax_t byte_count_ ABSL_GUARDED_BY(writer_mutex_) = 0;
  std::unique_ptr<SqliteConnection> writer_ ABSL_PT_GUARDED_BY(writer_mutex_);
  Mutex failure_mutex_;
  absl::Status failure_ ABSL_GUARDED_BY(failure_mutex_);
  Mutex readers_mutex_;
  std::vector<std::unique_ptr<SqliteConnection>> idle_readers_ ABSL_GUARDED_BY(readers_mutex_);
};

}  // namespace carillon
