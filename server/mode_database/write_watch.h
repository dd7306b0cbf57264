// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "server/base/mutex.h"
#include "server/mode_database/mapping_guard.h"

struct sqlite3_file;

namespace carillon {

/// What SQLite has written to a file: its size and its first bytes. A smaller file was truncated by
/// somebody else, and one with other first bytes was overwritten. Safe from every thread.
class WrittenFile {
 public:
  /// `index` guards the mapping of the log's index. Once that was truncated, no file is whole,
  /// because SQLite then no longer knows the pages of the log.
  explicit WrittenFile(const MappingGuard& index) : index_(index) {}

  /// Notes that SQLite has opened `file`, with the size and the first bytes that it has.
  void Open(sqlite3_file& file);

  /// Returns whether the file has at least the bytes that SQLite gave it, by `look()`, which
  /// returns the file's size. Once this has returned false, it always does.
  bool IsWhole(absl::FunctionRef<int64_t()> look);

  /// Notes that another process has changed the file by SQLite, so that it has other first bytes.
  void ForgetHead();

  /// Takes the first bytes that the file has now for those that SQLite wrote.
  void TakeHead(sqlite3_file& file);

  /// Returns whether the file is whole and has the first bytes that SQLite wrote. If it has others,
  /// it is not whole from now on, unless `must_be_ours()` then returns false, because another
  /// process may have changed them by SQLite.
  bool HasHead(sqlite3_file& file, absl::FunctionRef<bool()> must_be_ours);

  /// Lets all later calls of Write and Truncate fail.
  void Close();

  /// Writes to the file, as sqlite3_io_methods::xWrite does, unless it is not whole or its first
  /// bytes are not those that SQLite wrote. Then it is not whole from now on.
  int Write(sqlite3_file& file, const void* data, int size, int64_t offset);

  /// Changes the file's size, as sqlite3_io_methods::xTruncate does, unless it is not whole.
  int Truncate(sqlite3_file& file, int64_t byte_count);

  int64_t byte_count() const;

 private:
  void ReadHead(sqlite3_file& file) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteHead(const void* data, int size, int64_t offset) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const MappingGuard& index_;
  mutable Mutex mutex_;
  int64_t byte_count_ ABSL_GUARDED_BY(mutex_) = 0;
  /// The header of a database has 100 bytes, and that of a log 32.
  std::string head_ ABSL_GUARDED_BY(mutex_);
  bool knows_head_ ABSL_GUARDED_BY(mutex_) = false;
  bool lost_ ABSL_GUARDED_BY(mutex_) = false;
};

/// A layer between SQLite and the operating system (a VFS) that knows what SQLite has written to a
/// database file and its write-ahead log. It looks at a file's size and first bytes before each
/// write, because a write beyond the end of a truncated file makes the file as large as it was, and
/// at the first bytes of the database before and after each change, which goes to the log at first.
/// It also guards the mapping of the log's index (the -shm file), whose header tells it whether
/// another process has changed the files by SQLite.
class WriteWatch {
 public:
  /// Adds the layer to SQLite under a new name.
  WriteWatch();
  /// Every connection through the layer must have been closed.
  ~WriteWatch();
  WriteWatch(const WriteWatch&) = delete;
  WriteWatch& operator=(const WriteWatch&) = delete;

  /// Name of the layer, for the one connection that writes.
  const std::string& vfs_name() const { return name_; }

  WrittenFile& database() { return database_; }
  WrittenFile& log() { return log_; }
  const WrittenFile& database() const { return database_; }
  const WrittenFile& log() const { return log_; }

 private:
  struct Layer;
  const std::string name_;
  MappingGuard index_;
  WrittenFile database_{index_};
  WrittenFile log_{index_};
  std::unique_ptr<Layer> layer_;
};

}  // namespace carillon
