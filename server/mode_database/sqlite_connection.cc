// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/sqlite_connection.h"

#include <SQLiteCpp/Backup.h>
#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr int kBusyTimeoutMs = static_cast<int>(SqliteConnection::kLongestWait.count());

absl::Status Damaged(absl::string_view what) {
  return Refusal(
      absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
      absl::StrCat(
          "the database file is damaged, or the disk under it fails (", what,
          "): see the system's log; then stop the daemon, and run carillond db restore, or "
          "recover the file with sqlite3 as docs/troubleshoot.md describes"));
}

absl::Status NobodyWaits() { return absl::CancelledError("nobody waits for the copy any more"); }

/// A URI of SQLite for a file that nobody changes. No lock is taken, and no file is made beside it.
std::string UriOf(const std::filesystem::path& file) {
  std::string uri = "file:";
  for (const char byte : std::filesystem::absolute(file).string()) {
    const bool is_plain = absl::ascii_isalnum(static_cast<unsigned char>(byte)) || byte == '/';
    absl::StrAppend(&uri, is_plain ? std::string(1, byte)
                                   : absl::StrFormat("%%%02X", static_cast<unsigned char>(byte)));
  }
  return uri + "?immutable=1";
}

absl::Status Full(absl::string_view what) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
      absl::StrCat("no space is left for the database (", what, "): free some, or delete models"));
}

absl::Status ToStatus(const SQLite::Exception& error) {
  const absl::string_view what = error.what();
  switch (error.getErrorCode() & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return Refusal(absl::StatusCode::kUnavailable, "DATABASE_BUSY",
                     absl::StrCat("another process holds the database (", what,
                                  "): end it, or give this daemon a folder of its own"));
    case SQLITE_NOMEM:
      return Refusal(absl::StatusCode::kResourceExhausted, "SERVER_OUT_OF_MEMORY",
                     absl::StrCat("the daemon has not enough memory for its database (", what,
                                  "): ask for less, or give the daemon more memory"));
    case SQLITE_FULL:
      return Full(what);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return Damaged(what);
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                     absl::StrCat("the database cannot be opened or written (", what,
                                  "): see that this user may write in its folder"));
    case SQLITE_IOERR:
      // SQLite could not enlarge its -shm file, because the disk is full.
      if (error.getExtendedErrorCode() == SQLITE_IOERR_SHMSIZE) return Full(what);
      return Refusal(absl::StatusCode::kUnavailable, "DATABASE_IO_ERROR",
                     absl::StrCat("the disk under the database fails (", what,
                                  "): see the system's log, and try again"));
    default:
      return Refusal(absl::StatusCode::kInternal, "DATABASE_ERROR", absl::StrCat("SQLite: ", what));
  }
}

// Turns the library's exceptions into statuses. None leaves this file.
template <typename Body>
absl::Status Guarded(Body body) {
  try {
    return body();
  } catch (const SQLite::Exception& error) {
    return ToStatus(error);
  }
}

void Bind(SQLite::Statement& statement, std::initializer_list<SqlParameter> parameters) {
  int index = 0;
  for (const SqlParameter& parameter : parameters) {
    ++index;
    if (const auto* number = std::get_if<int64_t>(&parameter)) {
      statement.bind(index, *number);
    } else if (const auto* text = std::get_if<std::string_view>(&parameter)) {
      statement.bind(index, std::string(*text));
    } else {
      // An empty view may have no address, which SQLite would take for NULL.
      const std::string_view bytes = std::get<SqlBlob>(parameter).bytes;
      statement.bindNoCopy(index, bytes.empty() ? "" : bytes.data(),
                           static_cast<int>(bytes.size()));
    }
  }
}

class Row final : public SqlRow {
 public:
  explicit Row(SQLite::Statement& statement) : statement_(statement) {}
  int64_t Int(int column) const override { return statement_.getColumn(column).getInt64(); }
  std::string Text(int column) const override { return statement_.getColumn(column).getString(); }
  std::string_view Blob(int column) const override {
    const SQLite::Column blob = statement_.getColumn(column);
    return {static_cast<const char*>(blob.getBlob()), static_cast<size_t>(blob.getBytes())};
  }

 private:
  SQLite::Statement& statement_;
};

}  // namespace

struct SqliteConnection::State {
  explicit State(const std::string& file)
      : database(file, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE, kBusyTimeoutMs) {}
  SQLite::Database database;
};

SqliteConnection::SqliteConnection(std::unique_ptr<State> state) : state_(std::move(state)) {}
SqliteConnection::~SqliteConnection() = default;

absl::StatusOr<std::unique_ptr<SqliteConnection>> SqliteConnection::Open(
    const std::filesystem::path& file) {
  std::unique_ptr<State> state;
  RETURN_IF_ERROR(Guarded([&] {
    state = std::make_unique<State>(file.string());
    return absl::OkStatus();
  }));
  return std::unique_ptr<SqliteConnection>(new SqliteConnection(std::move(state)));
}

absl::Status SqliteConnection::Run(const char* sql,
                                   std::initializer_list<SqlParameter> parameters) {
  return Guarded([&] {
    SQLite::Statement statement(state_->database, sql);
    Bind(statement, parameters);
    statement.exec();
    return absl::OkStatus();
  });
}

absl::Status SqliteConnection::RunScript(const char* sql) {
  return Guarded([&] {
    state_->database.exec(sql);
    return absl::OkStatus();
  });
}

absl::Status SqliteConnection::Query(const char* sql,
                                     std::initializer_list<SqlParameter> parameters,
                                     absl::FunctionRef<absl::Status(const SqlRow&)> on_row) {
  return Guarded([&] {
    SQLite::Statement statement(state_->database, sql);
    Bind(statement, parameters);
    while (statement.executeStep()) {
      RETURN_IF_ERROR(on_row(Row(statement)));
    }
    return absl::OkStatus();
  });
}

absl::Status SqliteConnection::BackUpTo(const std::filesystem::path& copy,
                                        absl::FunctionRef<bool()> goes_on) {
  constexpr int kPages = 16;  // 1 MiB at a time
  constexpr int kPauseMs = 10;
  return Guarded([&]() -> absl::Status {
    // A transaction has its snapshot from its first query on. Without it SQLite would begin the
    // copy anew whenever others write.
    state_->database.execAndGet("SELECT count(*) FROM sqlite_schema");
    SQLite::Database target(copy.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE,
                            kBusyTimeoutMs);
    target.exec("PRAGMA journal_mode = OFF");  // a copy that fails is removed
    SQLite::Backup backup(target, state_->database);
    int result = SQLITE_OK;
    while (result != SQLITE_DONE) {
      if (!goes_on()) return NobodyWaits();
      result = backup.executeStep(kPages);
      if (result == SQLITE_BUSY || result == SQLITE_LOCKED) sqlite3_sleep(kPauseMs);
    }
    return absl::OkStatus();
  });
}

absl::Status SqliteConnection::CheckStructure(const std::filesystem::path& copy,
                                              absl::FunctionRef<bool()> goes_on) {
  constexpr int kInstructions = 10'000;  // between two calls of `goes_on`
  const auto is_over = [](void* asked) {
    return (*static_cast<absl::FunctionRef<bool()>*>(asked))() ? 0 : 1;
  };
  absl::Status status = Guarded([&]() -> absl::Status {
    SQLite::Database database(UriOf(copy), SQLite::OPEN_READONLY | SQLite::OPEN_URI);
    sqlite3_progress_handler(database.getHandle(), kInstructions, is_over, &goes_on);
    const std::string fault = database.execAndGet("PRAGMA quick_check(1)").getString();
    return fault == "ok" ? absl::OkStatus() : Damaged(fault);
  });
  return goes_on() ? status : NobodyWaits();
}

void SqliteConnection::SetLongestWait(std::chrono::milliseconds wait) {
  state_->database.setBusyTimeout(static_cast<int>(wait.count()));
}

int64_t SqliteConnection::changed_row_count() const { return state_->database.getChanges(); }

int64_t SqliteConnection::last_row_id() const { return state_->database.getLastInsertRowid(); }

}  // namespace carillon
