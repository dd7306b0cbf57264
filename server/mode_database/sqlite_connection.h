// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// A parameter that is stored as bytes; a plain string is stored as text.
struct SqlBlob {
  std::string_view bytes;
};

using SqlParameter = std::variant<int64_t, std::string_view, SqlBlob>;

/// The present row of a query. Columns count from 0.
class SqlRow {
 public:
  virtual ~SqlRow() = default;
  virtual int64_t Int(int column) const = 0;
  virtual std::string Text(int column) const = 0;
  /// Returns bytes that are valid until the next row.
  virtual std::string_view Blob(int column) const = 0;
};

/// One connection to a SQLite file; one thread at a time. Every call can fail with Unavailable
/// (DATABASE_BUSY), ResourceExhausted (DATABASE_FULL: no space left; SERVER_OUT_OF_MEMORY),
/// DataLoss (DATABASE_CORRUPT) or Internal (DATABASE_ERROR).
class SqliteConnection {
 public:
  /// How long a new connection waits for a lock that another process holds.
  static constexpr std::chrono::milliseconds kLongestWait{10'000};

  /// Opens the file, and creates it unless it exists.
  static absl::StatusOr<std::unique_ptr<SqliteConnection>> Open(const std::filesystem::path& file);
  ~SqliteConnection();

  /// Runs one statement that returns no rows.
  absl::Status Run(const char* sql, std::initializer_list<SqlParameter> parameters = {});

  /// Runs statements without parameters, separated by semicolons.
  absl::Status RunScript(const char* sql);

  /// Runs one query and calls `on_row` for each row. Stops at the first error of `on_row` and
  /// returns it.
  absl::Status Query(const char* sql, std::initializer_list<SqlParameter> parameters,
                     absl::FunctionRef<absl::Status(const SqlRow&)> on_row);

  /// Copies the snapshot of the present transaction into a new file, piece by piece, while
  /// `goes_on` returns true. Errors: Cancelled if it does not.
  absl::Status BackUpTo(const std::filesystem::path& copy, absl::FunctionRef<bool()> goes_on);

  /// Checks the structure of a file that nobody changes, while `goes_on` returns true. Errors:
  /// DataLoss (DATABASE_CORRUPT), Cancelled.
  static absl::Status CheckStructure(const std::filesystem::path& copy,
                                     absl::FunctionRef<bool()> goes_on);

  /// Sets how long the following statements wait for a lock that another process holds.
  void SetLongestWait(std::chrono::milliseconds wait);

  /// Number of rows that the last statement changed.
  int64_t changed_row_count() const;

  /// Key of the row inserted last.
  int64_t last_row_id() const;

 private:
  struct State;
  explicit SqliteConnection(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace carillon
