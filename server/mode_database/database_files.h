// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "server/base/mutex.h"

namespace carillon {

/// Watches a database file and its write-ahead log from outside of SQLite, which goes on writing to
/// files that somebody has removed or replaced. Safe from every thread.
class DatabaseFiles {
 public:
  explicit DatabaseFiles(const std::filesystem::path& file) : file_(file) {}

  /// Takes the sizes after a write of our own for the right ones. Errors: FailedPrecondition
  /// (DATABASE_LOST: a file is another one than before); it stays so from then on.
  absl::Status Remember();

  /// Errors: as above, and if a file is smaller than at the last Remember.
  absl::Status Check();

 private:
  struct Seen {
    dev_t device = 0;
    ino_t inode = 0;
    off_t byte_count = 0;
  };
  static std::optional<Seen> Look(const std::filesystem::path& file);
  static bool IsSame(const std::optional<Seen>& before, const std::optional<Seen>& now);
  static bool IsWhole(const std::optional<Seen>& before, const std::optional<Seen>& now);
  absl::Status Judge() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::filesystem::path file_;
  Mutex mutex_;
  std::optional<Seen> database_ ABSL_GUARDED_BY(mutex_);
  std::optional<Seen> log_ ABSL_GUARDED_BY(mutex_);
  bool lost_ ABSL_GUARDED_BY(mutex_) = false;
};

/// The number of committed changes, in a file beside the database. A database that has fewer has
/// lost its write-ahead log, or is an older copy. The file is written without waiting for the disk:
/// after a loss of power it may count fewer changes than the database, but never more.
class ChangeCount {
 public:
  /// `file`: the database's.
  explicit ChangeCount(const std::filesystem::path& file);
  ~ChangeCount();
  ChangeCount(const ChangeCount&) = delete;
  ChangeCount& operator=(const ChangeCount&) = delete;

  /// The count in the file; zero if there is none.
  int64_t Read() const;

  void Write(int64_t count) const;

 private:
  int descriptor_;
};

/// Space on the disk that is given up when the disk is full, so that models can still be deleted.
class DiskReserve {
 public:
  /// `file`: the database's; the reserve lies beside it.
  explicit DiskReserve(const std::filesystem::path& file);

  /// Takes 16 MiB, unless it has them already or the disk has little more.
  void Take() const;

  void Release() const;

 private:
  const std::filesystem::path file_;
};

/// A new name beside the database for a backup in progress.
std::filesystem::path NewBackupFile(const std::filesystem::path& file);

/// Removes the backups that a killed process has left.
void RemoveUnfinishedBackups(const std::filesystem::path& file);

}  // namespace carillon
