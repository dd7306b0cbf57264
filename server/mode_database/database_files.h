// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/mode_database/write_watch.h"

namespace carillon {

/// Watches a database file and its write-ahead log, because SQLite itself goes on writing to files
/// that somebody has removed, replaced, truncated or overwritten. Safe from every thread.
class DatabaseFiles {
 public:
  explicit DatabaseFiles(const std::filesystem::path& file) : file_(file) {}

  /// Name of the VFS through which the connection that writes must be opened, and which tells this
  /// object what SQLite has written to the files. That connection must be closed first.
  const std::string& vfs_name() const { return writes_.vfs_name(); }

  /// Checks both files. Errors: FailedPrecondition (DATABASE_LOST: a file was removed or replaced,
  /// or is smaller than SQLite has made it, or a write has found that its first bytes are not
  /// those that SQLite wrote, or the -shm file was truncated). Once a function of
  /// this object has returned DATABASE_LOST, all later calls return it. The first call remembers
  /// which files they are, and must follow the first write.
  absl::Status Check();

  /// Checks both files, runs `work`, which may change them, and checks them again. Each write of
  /// the daemon must be made here. Errors: DATABASE_LOST, or the work's error.
  absl::Status Change(absl::FunctionRef<absl::Status()> work);

  /// Returns the size of both files.
  int64_t byte_count() const {
    return writes_.database().byte_count() + writes_.log().byte_count();
  }

 private:
  struct Seen {
    dev_t device = 0;
    ino_t inode = 0;
  };
  static bool IsWhole(const std::filesystem::path& file, std::optional<Seen>& seen,
                      WrittenFile& written);

  const std::filesystem::path file_;
  WriteWatch writes_;
  Mutex mutex_;
  std::optional<Seen> database_ ABSL_GUARDED_BY(mutex_);
  std::optional<Seen> log_ ABSL_GUARDED_BY(mutex_);
  bool lost_ ABSL_GUARDED_BY(mutex_) = false;
};

/// An empty file beside a database that was lost while the daemon ran. The structure of such a
/// database must be checked before it is used again.
class LossMark {
 public:
  /// `file` is the database file.
  explicit LossMark(const std::filesystem::path& file);

  /// A mark that cannot be set is not there at the next start.
  void Set() const;
  bool IsSet() const;
  void Remove() const;

 private:
  const std::filesystem::path file_;
};

/// The number of committed changes, in a file beside the database. A database with fewer changes
/// has lost its write-ahead log or is an older copy. The daemon does not wait until the file is on
/// the disk. After a loss of power the file may therefore count fewer changes than the database
/// has, but never more.
class ChangeCount {
 public:
  /// `file` is the database file.
  explicit ChangeCount(const std::filesystem::path& file);
  ~ChangeCount();
  ChangeCount(const ChangeCount&) = delete;
  ChangeCount& operator=(const ChangeCount&) = delete;

  /// Returns the count in the file, or zero if the file has no count.
  int64_t Read() const;

  void Write(int64_t count) const;

 private:
  int descriptor_;
};

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
