// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"

namespace carillon {

/// Returns the name of the write-ahead log of the database `file`, which has its newest changes.
std::filesystem::path LogOf(const std::filesystem::path& file);

/// Looks whether a database file is still the one that was opened, because SQLite itself goes on
/// writing to a file that somebody has removed, replaced or truncated. Safe from every thread.
class FileWatch {
 public:
  explicit FileWatch(const std::filesystem::path& file) : file_(file) {}

  /// Looks at the file once. Errors: FailedPrecondition (DATABASE_LOST: the file was removed or
  /// replaced). Once a function of this object has returned DATABASE_LOST, all later calls return
  /// it. The first call remembers which file it is.
  absl::Status Check();

  /// Notes that the file was truncated. Returns DATABASE_LOST.
  absl::Status Lose();

 private:
  absl::Status Lost() const;

  const std::filesystem::path file_;
  Mutex mutex_;
  std::optional<std::pair<dev_t, ino_t>> seen_ ABSL_GUARDED_BY(mutex_);
  bool lost_ ABSL_GUARDED_BY(mutex_) = false;
};

/// Returns the kind of the network file system on which a file lies, such as "NFS", or an empty
/// text if the file lies on a disk of this computer. `magic` is the f_type of statfs.
std::string NetworkFileSystem(int64_t magic);
std::string NetworkFileSystemOf(const std::filesystem::path& file);

/// A file that reserves space on the disk. It is removed when the disk is full, so that models can
/// still be deleted.
class DiskReserve {
 public:
  /// `file` is the database file. The reserve is in the same folder.
  explicit DiskReserve(const std::filesystem::path& file);

  /// Returns the bytes to reserve on a disk with so much free space: a quarter of it, at least 1
  /// MiB and at most 16 MiB. Below 2 MiB nothing is reserved.
  static uintmax_t SizeOn(uintmax_t free_bytes);

  /// Reserves the bytes that SizeOn returns, or extends a smaller reserve to them. A reserve on a
  /// disk that has become fuller stays as it is.
  void Take() const;

  void Release() const;

 private:
  const std::filesystem::path file_;
};

/// Returns the file to which a database's name leads, because SQLite keeps the log beside that
/// file. It need not exist. Errors: FailedPrecondition (DATABASE_UNUSABLE: the name is that of a
/// folder or a device, or of a symbolic link that leads to no file).
absl::StatusOr<std::filesystem::path> FollowLinks(const std::filesystem::path& file);

/// Returns a name beside the database for a copy in progress. `kind` says what makes the copy, such
/// as `restore`.
std::filesystem::path UnfinishedCopy(const std::filesystem::path& file, const std::string& kind);

/// Returns a new name for a backup in progress.
std::filesystem::path NewBackupFile(const std::filesystem::path& file);

/// Removes the unfinished copies that a killed process has left.
void RemoveUnfinishedCopies(const std::filesystem::path& file);

}  // namespace carillon
