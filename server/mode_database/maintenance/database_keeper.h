// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "server/mode_database/database.h"

namespace carillon {

/// Looks whether the database can be changed (Database::TryAgain), and gives free pages back to the
/// disk.
class DatabaseKeeper {
 public:
  /// Takes the first result of Database::TryAgain, and each result that differs from the previous
  /// one.
  using Observer = std::function<void(const absl::Status& state)>;

  /// `database` must outlive the keeper.
  DatabaseKeeper(Database& database, Observer observer)
      : database_(database), observer_(std::move(observer)) {}

  /// Must be called about once a second, by one thread at a time. Waits for the disk and for the
  /// write lock of the database.
  void Look();

 private:
  Database& database_;
  const Observer observer_;
  std::optional<absl::Status> last_;
};

}  // namespace carillon
