// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <semaphore>
#include <thread>

#include "absl/status/status.h"
#include "server/mode_database/database.h"

namespace carillon {

/// A thread that looks after the files of a database once a second: whether they are still there,
/// and whether the database can shrink.
class DatabaseKeeper {
 public:
  /// Takes the result of Database::CheckFiles: the first, and each that differs from the one
  /// before.
  using Observer = std::function<void(const absl::Status& files)>;

  /// `database` must outlive the keeper.
  DatabaseKeeper(Database& database, Observer observer);

  /// Joins the thread.
  ~DatabaseKeeper();
  DatabaseKeeper(const DatabaseKeeper&) = delete;
  DatabaseKeeper& operator=(const DatabaseKeeper&) = delete;

 private:
  void Run();

  Database& database_;
  const Observer observer_;
  std::binary_semaphore stop_{0};
  std::thread thread_;
};

}  // namespace carillon
