// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <system_error>
#include <utility>

#include "absl/algorithm/container.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/schema.h"

namespace carillon {
namespace {

// Large pages suit large blobs. An existing file keeps its page size. A reader caches eight pages,
// which hold a path through a tree; the operating system caches the file for all of them.
constexpr char kReader[] = "PRAGMA page_size = 65536; PRAGMA cache_size = -512;";
// The readers that stay open. The readers of a busier moment are closed after it, so that the
// daemon's memory does not remember its busiest moment.
constexpr size_t kMostIdleReaders = 4;
// Only the writer sets auto_vacuum, with which a new file can shrink: on an existing file this
// pragma is a write, and a reader would wait for the writer. Changes go from the log into the file
// whenever the log exceeds 4 MiB, so that little is lost with a log that somebody removes after a
// crash. While a backup is being made, the log grows, and after it shrinks to 16 MiB again.
// Debian's SQLite overwrites deleted rows with zeros, and a full disk has no space in the log for
// these pages; with secure_delete = FAST a deletion writes no page for that alone.
constexpr char kWriter[] =
    "PRAGMA page_size = 65536; PRAGMA auto_vacuum = INCREMENTAL; PRAGMA wal_autocheckpoint = 64; "
    "PRAGMA journal_size_limit = 16777216; PRAGMA secure_delete = FAST;";

absl::StatusOr<std::unique_ptr<SqliteConnection>> Connect(const std::filesystem::path& file,
                                                          const char* first = kReader) {
  ASSIGN_OR_RETURN(auto connection, SqliteConnection::Open(file));
  RETURN_IF_ERROR(connection->RunScript(first));
  // Without temporary files in $TMPDIR a change cannot fail because that is full.
  RETURN_IF_ERROR(connection->RunScript(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; "
      "PRAGMA temp_store = MEMORY;"));
  return connection;
}

absl::StatusOr<int64_t> Figure(SqliteConnection& connection, const char* sql) {
  int64_t figure = 0;
  RETURN_IF_ERROR(connection.Query(sql, {}, [&](const SqlRow& row) {
    figure = row.Int(0);
    return absl::OkStatus();
  }));
  return figure;
}

/// Whether at least a quarter of the pages, and 4 MiB, are free and can be given back to the disk.
absl::StatusOr<bool> ShouldShrink(SqliteConnection& writer) {
  constexpr int64_t kLeastFreePages = 64;
  ASSIGN_OR_RETURN(const int64_t can_shrink, Figure(writer, "PRAGMA auto_vacuum"));
  ASSIGN_OR_RETURN(const int64_t free_count, Figure(writer, "PRAGMA freelist_count"));
  ASSIGN_OR_RETURN(const int64_t page_count, Figure(writer, "PRAGMA page_count"));
  return can_shrink != 0 && free_count >= kLeastFreePages && free_count * 4 >= page_count;
}

/// Copies the log into the file, and truncates the log. Returns whether it could.
bool EmptyLog(SqliteConnection& writer) {
  const absl::StatusOr<int64_t> busy = Figure(writer, "PRAGMA wal_checkpoint(TRUNCATE)");
  return busy.ok() && *busy == 0;
}

/// Returns a file's size, or zero if there is no such file.
uintmax_t SizeOf(const std::filesystem::path& file) {
  std::error_code error;
  const uintmax_t byte_count = std::filesystem::file_size(file, error);
  return error ? 0 : byte_count;
}

/// SQLite holds locks of its own for moments.
constexpr std::chrono::milliseconds kMoment{50};

/// Lets the writer wait for other processes for the rest of the longest wait, which began at
/// `asked`. The changes that queue up while another process holds the database thus all fail at the
/// same time.
void LimitWait(SqliteConnection& writer, std::chrono::steady_clock::time_point asked) {
  const auto waited = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::steady_clock::now() - asked);
  writer.SetLongestWait(std::max(kMoment, SqliteConnection::kLongestWait - waited));
}

/// With less free space the disk counts as full, after a change has failed for want of space.
constexpr uintmax_t kLeastFreeBytes = 4 << 20;

uintmax_t FreeBytes(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  return error ? 0 : space.available;
}

absl::Status DiskFull(const std::filesystem::path& file) {
  return Refusal(absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
                 absl::StrCat("no space is left on the disk of ", file.string(),
                              ": free some, or delete models"));
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
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::absolute(file).parent_path(), error);
  if (error) return Unusable(file, error.message());
  ASSIGN_OR_RETURN(const std::filesystem::path real, FollowLinks(file));
  std::unique_ptr<Database> database(new Database(real));
  RETURN_IF_ERROR(database->ConnectWriter());
  return database;
}

absl::Status Database::ConnectWriter() {
  const MutexLock lock(&writer_mutex_);
  auto connection = Connect(file_, kWriter);
  if (ToErrorInfo(connection.status()).reason() == "DATABASE_FULL") {
    reserve_.Release();
    connection = Connect(file_, kWriter);
  }
  const absl::Status status = connection.status();
  if (absl::IsInternal(status) || absl::IsFailedPrecondition(status)) {
    return Unusable(file_, status.message());
  }
  RETURN_IF_ERROR(status);
  writer_ = *std::move(connection);
  return Change([&writer = *writer_] {
    return InTransaction(writer, "BEGIN IMMEDIATE", [](SqliteConnection& c) { return Migrate(c); });
  });
}

// Another program that uses SQLite may make the file smaller, for example by VACUUM. The file then
// still has the pages that SQLite counts.
absl::Status Database::CheckSize() {
  const uintmax_t byte_count = SizeOf(file_);
  if (byte_count >= byte_count_) return absl::OkStatus();
  const absl::StatusOr<int64_t> page_count = Figure(*writer_, "PRAGMA page_count");
  const absl::StatusOr<int64_t> page_bytes = Figure(*writer_, "PRAGMA page_size");
  const bool has_all = page_count.ok() && page_bytes.ok() &&
                       byte_count >= static_cast<uintmax_t>(*page_count * *page_bytes);
  return has_all ? absl::OkStatus() : watch_.Lose();
}

absl::Status Database::Change(absl::FunctionRef<absl::Status()> work) {
  RETURN_IF_ERROR(watch_.Check());
  RETURN_IF_ERROR(CheckSize());
  absl::Status worked = work();
  byte_count_ = SizeOf(file_);
  RETURN_IF_ERROR(watch_.Check());
  return worked;
}

absl::Status Database::Write(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  const auto asked = std::chrono::steady_clock::now();
  MutexLock lock(&writer_mutex_);
  LimitWait(*writer_, asked);
  const absl::Status status = WriteLocked(body);
  const bool is_full = ToErrorInfo(status).reason() == "DATABASE_FULL";
  return is_full && MakeSpaceLocked() ? WriteLocked(body) : status;
}

absl::Status Database::WriteToFree(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  const auto has_no_room = [](const absl::Status& status) {
    return absl::IsResourceExhausted(status) ||
           (absl::IsUnavailable(status) && ToErrorInfo(status).reason() != "DATABASE_BUSY");
  };
  const auto asked = std::chrono::steady_clock::now();
  MutexLock lock(&writer_mutex_);
  LimitWait(*writer_, asked);
  absl::Status status = WriteLocked(body);
  if (!has_no_room(status)) return status;
  // After a checkpoint the log is written from its beginning again.
  RETURN_IF_ERROR(Change([&writer = *writer_] {
    Figure(writer, "PRAGMA wal_checkpoint(RESTART)").status().IgnoreError();
    return absl::OkStatus();
  }));
  status = WriteLocked(body);
  if (!has_no_room(status)) return status;
  reserve_.Release();
  status = WriteLocked(body);
  if (ToErrorInfo(status).reason() != "DATABASE_FULL") return status;
  return Refusal(
      absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
      absl::StrCat("the disk of ", file_.string(),
                   " has no space even for a deletion: free 2 MiB on it, and try again"));
}

absl::Status Database::WriteLocked(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  absl::Status status =
      Change([&writer = *writer_, body] { return InTransaction(writer, "BEGIN IMMEDIATE", body); });
  RememberFailure(status);
  return status;
}

void Database::RememberFailure(const absl::Status& status) {
  constexpr std::array<absl::string_view, 4> kConcernEveryChange = {
      "DATABASE_FULL", "DATABASE_BUSY", "DATABASE_IO_ERROR", "DATABASE_CORRUPT"};
  const std::string reason = ToErrorInfo(status).reason();
  const MutexLock lock(&failure_mutex_);
  if (status.ok() || absl::c_linear_search(kConcernEveryChange, reason)) failure_ = status;
}

absl::Status Database::CheckState() {
  RETURN_IF_ERROR(watch_.Check());
  const MutexLock lock(&failure_mutex_);
  return failure_;
}

absl::Status Database::TryAgain() {
  absl::Status state = CheckState();
  const std::string reason = ToErrorInfo(state).reason();
  if (state.ok() || reason == "DATABASE_LOST") return state;
  if (reason == "DATABASE_FULL" && FreeBytes(folder()) < kLeastFreeBytes) return state;
  MutexLock lock(&writer_mutex_);
  writer_->SetLongestWait(kMoment);
  WriteLocked([](SqliteConnection& connection) {
    return connection.Run("INSERT OR REPLACE INTO facts (name, value) VALUES ('tried_again', '')");
  }).IgnoreError();
  return CheckState();
}

void Database::CopyLog() {
  MutexLock lock(&writer_mutex_);
  const auto copy = [&writer = *writer_] {
    return Figure(writer, "PRAGMA wal_checkpoint(PASSIVE)").status();
  };
  Change(copy).IgnoreError();
}

absl::Status Database::Tidy() {
  MutexLock lock(&writer_mutex_);
  RETURN_IF_ERROR(watch_.Check());
  reserve_.Take();
  ASSIGN_OR_RETURN(const bool should_shrink, ShouldShrink(*writer_));
  if (!should_shrink) return absl::OkStatus();
  return Change([&writer = *writer_] {
    RETURN_IF_ERROR(writer.RunScript("PRAGMA incremental_vacuum(256)"));
    return Figure(writer, "PRAGMA wal_checkpoint(PASSIVE)").status();
  });
}

bool Database::MakeSpace() {
  MutexLock lock(&writer_mutex_);
  return MakeSpaceLocked();
}

bool Database::MakeSpaceLocked() {
  // The log has to hold the pages of a portion, for which a full disk may have little room.
  constexpr int kMostPortions = 16;
  SqliteConnection& writer = *writer_;
  const uintmax_t before = SizeOf(file_) + SizeOf(LogOf(file_));
  for (int portion = 0; portion < kMostPortions; ++portion) {
    const absl::StatusOr<bool> should_shrink = ShouldShrink(writer);
    if (!should_shrink.ok() || !*should_shrink) break;
    const auto shrink = [&] {
      // Without the reserve, the log of a full disk cannot be emptied if the file has to grow.
      if (!EmptyLog(writer)) {
        reserve_.Release();
        EmptyLog(writer);
      }
      RETURN_IF_ERROR(writer.RunScript("PRAGMA incremental_vacuum(64)"));
      EmptyLog(writer);
      return absl::OkStatus();
    };
    if (!Change(shrink).ok()) break;
  }
  return SizeOf(file_) + SizeOf(LogOf(file_)) < before;
}

absl::StatusOr<SpoolFile> Database::MakeSpool() {
  RETURN_IF_ERROR(watch_.Check());
  return SpoolFile::Make(folder(), [this] {
    const bool made = MakeSpace();
    if (!made) RememberFailure(DiskFull(file_));
    return made;
  });
}

absl::Status Database::Read(absl::FunctionRef<absl::Status(SqliteConnection&)> body) {
  ASSIGN_OR_RETURN(auto reader, TakeReader());
  absl::Status status = InTransaction(*reader, "BEGIN DEFERRED", body);
  MutexLock lock(&readers_mutex_);
  if (idle_readers_.size() < kMostIdleReaders) idle_readers_.push_back(std::move(reader));
  return status;
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
  RETURN_IF_ERROR(watch_.Check());
  return Connect(file_);
}

}  // namespace carillon
