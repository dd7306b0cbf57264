// SPDX-License-Identifier: Apache-2.0
#pragma once

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
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// The SQLite file with its schema: one writer at a time, readers on connections of their own. Safe
/// from every thread.
class Database {
 public:
  /// As ModeDatabase::Open.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::filesystem::path& file);

  /// Runs `body` in one transaction. It is committed and on the disk when this returns OK, and
  /// rolled back if `body` fails.
  absl::Status Write(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// As Write, for a change that frees space: where the disk is full, it makes room for the change
  /// first, and runs `body` again.
  absl::Status WriteToFree(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// Errors: FailedPrecondition (DATABASE_LOST), from which on every Write fails so.
  absl::Status CheckFiles() { return files_.Check(); }

  /// Gives some free pages back to the disk if they are more than a quarter of the file, and renews
  /// the reserve for a full disk. Files of older programs do not shrink before `db repair`.
  absl::Status Tidy();

  /// Says how many changes were acknowledged once and are not in the file that was opened, because
  /// its write-ahead log was removed or it is an older copy; empty if none.
  std::string MissingChanges() const;

  /// Runs `body` on one snapshot of the database.
  absl::Status Read(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// Runs `body` on a connection of its own, for statements that SQLite refuses in a transaction.
  absl::Status ReadOutsideTransaction(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// The folder for files that wait for a transaction: it is on the same disk.
  std::filesystem::path folder() const { return file_.parent_path(); }
  const std::filesystem::path& file() const { return file_; }

 private:
  Database(std::filesystem::path file, std::unique_ptr<SqliteConnection> writer)
      : file_(std::move(file)),
        files_(file_),
        change_count_file_(file_),
        reserve_(file_),
        writer_(std::move(writer)) {}

  absl::Status ReadChangeCount();
  absl::Status WriteLocked(absl::FunctionRef<absl::Status(SqliteConnection&)> body)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(writer_mutex_);
  absl::StatusOr<std::unique_ptr<SqliteConnection>> TakeReader();

  const std::filesystem::path file_;
  DatabaseFiles files_;
  const ChangeCount change_count_file_;
  const DiskReserve reserve_;
  int64_t missing_change_count_ = 0;
  Mutex writer_mutex_;
  int64_t change_count_ ABSL_GUARDED_BY(writer_mutex_) = 0;
  std::unique_ptr<SqliteConnection> writer_ ABSL_PT_GUARDED_BY(writer_mutex_);
  Mutex readers_mutex_;
  std::vector<std::unique_ptr<SqliteConnection>> idle_readers_ ABSL_GUARDED_BY(readers_mutex_);
};

}  // namespace carillon
