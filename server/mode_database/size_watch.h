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

/// The size that SQLite has given a file. A smaller file was truncated by somebody else. Safe from
/// every thread.
class WrittenSize {
 public:
  /// `index` guards the mapping of the log's index. Once that was truncated, no file is whole,
  /// because SQLite then no longer knows the pages of the log.
  explicit WrittenSize(const MappingGuard& index) : index_(index) {}

  /// Notes that SQLite has opened a file of `byte_count` bytes.
  void Open(int64_t byte_count);

  /// Returns whether the file has at least the bytes that SQLite gave it, by `look()`, which
  /// returns the file's size. Once this has returned false, it always does.
  bool IsWhole(absl::FunctionRef<int64_t()> look);

  /// Lets all later calls of Write and Truncate fail.
  void Close();

  /// Writes to the file, as sqlite3_io_methods::xWrite does, unless it is not whole.
  int Write(sqlite3_file& file, const void* data, int size, int64_t offset);

  /// Changes the file's size, as sqlite3_io_methods::xTruncate does, unless it is not whole.
  int Truncate(sqlite3_file& file, int64_t byte_count);

  int64_t byte_count() const;

 private:
  const MappingGuard& index_;
  mutable Mutex mutex_;
  int64_t byte_count_ ABSL_GUARDED_BY(mutex_) = 0;
  bool lost_ ABSL_GUARDED_BY(mutex_) = false;
};

/// A layer between SQLite and the operating system (a VFS) that knows how large SQLite has made a
/// database file and its write-ahead log. It looks at a file's size before each write, because a
/// write beyond the end of a truncated file makes the file as large as it was. It also guards the
/// mapping of the log's index (the -shm file).
class SizeWatch {
 public:
  /// Adds the layer to SQLite under a new name.
  SizeWatch();
  /// Every connection through the layer must have been closed.
  ~SizeWatch();
  SizeWatch(const SizeWatch&) = delete;
  SizeWatch& operator=(const SizeWatch&) = delete;

  /// Name of the layer, for the one connection that writes.
  const std::string& vfs_name() const { return name_; }

  WrittenSize& database() { return database_; }
  WrittenSize& log() { return log_; }
  const WrittenSize& database() const { return database_; }
  const WrittenSize& log() const { return log_; }

 private:
  struct Layer;
  const std::string name_;
  MappingGuard index_;
  WrittenSize database_{index_};
  WrittenSize log_{index_};
  std::unique_ptr<Layer> layer_;
};

}  // namespace carillon
