// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database.h"

#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/schema.h"

namespace carillon {
namespace {

absl::StatusOr<std::unique_ptr<SqliteConnection>> Connect(const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(auto connection, SqliteConnection::Open(file));
  const absl::Status status =
      (connection)
          ->RunScript(
              // Large pages suit large blobs. An existing file keeps its page size.
              "PRAGMA page_size = 65536; PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; "
              "PRAGMA foreign_keys = ON;");
  if (!status.ok()) return status;
  return connection;
}

absl::Status Unusable(const std::filesystem::path& file, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("the database ", file.string(), " cannot be opened (", why,
                              "): name a folder that this user may write"));
}

absl::Status InTransaction(SqliteConnection& connection, const char* begin,
                           absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  absl::Status status = connection.Run(begin);
  if (!status.ok()) return status;
  status = body(connection);
  if (status.ok()) status = connection.Run("COMMIT");
  // Some errors, such as a full disk, have rolled back already; then this one fails harmlessly.
  if (!status.ok()) connection.Run("ROLLBACK").IgnoreError();
  return status;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::filesystem::path& file) {
  const std::filesystem::path absolute = std::filesystem::absolute(file);
  std::error_code error;
  std::filesystem::create_directories(absolute.parent_path(), error);
  if (error) return Unusable(absolute, error.message());
  auto connection = Connect(absolute);
  if (!connection.ok() &&
      (absl::IsInternal(connection.status()) || absl::IsFailedPrecondition(connection.status()))) {
    return Unusable(absolute, connection.status().message());
  }
  if (!connection.ok()) return connection.status();
  RETURN_IF_ERROR(InTransaction(**connection, "BEGIN IMMEDIATE",
                                [](SqliteConnection& c) { return Migrate(c); }));
  return std::unique_ptr<Database>(new Database(absolute, *std::move(connection)));
}

absl::Status Database::Write(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  MutexLock lock(&writer_mutex_);
  return InTransaction(*writer_, "BEGIN IMMEDIATE", body);
}

absl::Status Database::Read(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  ASSIGN_OR_RETURN(auto reader, TakeReader());
  absl::Status status = InTransaction(*reader, "BEGIN DEFERRED", body);
  MutexLock lock(&readers_mutex_);
  idle_readers_.push_back(std::move(reader));
  return status;
}

absl::Status Database::ReadOutsideTransaction(
    absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  auto connection = Connect(file_);
  return connection.ok() ? body(**connection) : connection.status();
}

absl::StatusOr<std::unique_ptr<SqliteConnection>> Database::TakeReader() {
  {
    MutexLock lock(&readers_mutex_);
    if (!idle_readers_.empty()) {
      auto reader = std::move(idle_readers_.back());
      idle_readers_.pop_back();
      return reader;
    }
  }
  return Connect(file_);
}

}  // namespace carillon
