// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
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

  /// Runs `body` on one snapshot of the database.
  absl::Status Read(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// Runs `body` on a connection of its own, for statements that SQLite refuses in a transaction.
  absl::Status ReadOutsideTransaction(absl::FunctionRef<absl::Status(SqliteConnection&)> body);

  /// The folder for files that wait for a transaction: it is on the same disk.
  std::filesystem::path folder() const { return file_.parent_path(); }

 private:
  Database(std::filesystem::path file, std::unique_ptr<SqliteConnection> writer)
      : file_(std::move(file)), writer_(std::move(writer)) {}

  absl::StatusOr<std::unique_ptr<SqliteConnection>> TakeReader();

  const std::filesystem::path file_;
  Mutex writer_mutex_;
  std::unique_ptr<SqliteConnection> writer_ ABSL_PT_GUARDED_BY(writer_mutex_);
  Mutex readers_mutex_;
  std::vector<std::unique_ptr<SqliteConnection>> idle_readers_ ABSL_GUARDED_BY(readers_mutex_);
};

}  // namespace carillon
