// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <semaphore>
#include <thread>

#include "absl/status/status.h"
#include "server/mode_database/database.h"

namespace carillon {

/// A thread that calls Database::CheckFiles once a second, and gives free pages back to the disk.
/// DatabaseFiles says which files are checked, and how.
class DatabaseKeeper {
 public:
  /// Takes the first result of Database::CheckFiles, and each result that differs from the previous
  /// one.
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
