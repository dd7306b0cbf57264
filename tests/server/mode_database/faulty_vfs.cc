// SPDX-License-Identifier: Apache-2.0
#include "tests/server/mode_database/faulty_vfs.h"

#include <sqlite3.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <map>
#include <memory>
#include <mutex>

namespace carillon {
namespace {

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

std::atomic<int64_t> good_count = kNever;
std::atomic<bool> failed = false;
std::atomic<DiskFault> disk_fault = DiskFault::kFull;

/// Whether this access fails.
bool Fails(bool write) {
  if (good_count == kNever || write == (disk_fault == DiskFault::kReadError)) return false;
  if (good_count-- > 0) return false;
  good_count = 0;
  failed = true;
  return true;
}

/// The accesses that wait until the test releases them.
class Latch {
 public:
  void HoldAfter(int64_t count) {
    const std::lock_guard lock(mutex_);
    good_count_ = count;
  }

  void Release() {
    const std::lock_guard lock(mutex_);
    good_count_ = kNever;
    changed_.notify_all();
  }

  bool AwaitHeld() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [this] { return held_count_ > 0; });
  }

  void Pass() {
    std::unique_lock lock(mutex_);
    if (good_count_ == kNever || good_count_-- > 0) return;
    good_count_ = 0;
    ++held_count_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return good_count_ == kNever; });
    --held_count_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int64_t good_count_ = kNever;
  int held_count_ = 0;
};

Latch latch;
Latch read_latch;
thread_local bool holds_reads = false;
std::atomic<bool> temporary_folder_is_full = false;

/// The methods of a file, with those that write replaced; SQLite's own lie behind.
struct Methods {
  sqlite3_io_methods replaced;  // first, so that a file's methods lead here
  const sqlite3_io_methods* real;
};

const sqlite3_io_methods& Real(sqlite3_file* file) {
  return *reinterpret_cast<const Methods*>(file->pMethods)->real;
}

int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
  latch.Pass();
  if (!Fails(true)) return Real(file).xWrite(file, data, size, offset);
  if (disk_fault == DiskFault::kReadOnly) return SQLITE_READONLY;
  Real(file).xWrite(file, data, size / 2, offset);
  return disk_fault == DiskFault::kFull ? SQLITE_FULL : SQLITE_IOERR_WRITE;
}

int Read(sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
  if (holds_reads) read_latch.Pass();
  return Fails(false) ? SQLITE_IOERR_READ : Real(file).xRead(file, data, size, offset);
}

int Sync(sqlite3_file* file, int flags) {
  latch.Pass();
  return disk_fault == DiskFault::kWriteError && Fails(true) ? SQLITE_IOERR_FSYNC
                                                             : Real(file).xSync(file, flags);
}

int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  latch.Pass();
  return disk_fault == DiskFault::kWriteError && Fails(true) ? SQLITE_IOERR_TRUNCATE
                                                             : Real(file).xTruncate(file, size);
}

/// One table for each of SQLite's own: these differ by the way of locking.
const sqlite3_io_methods* Wrapped(const sqlite3_io_methods* real) {
  static std::mutex mutex;
  static std::map<const sqlite3_io_methods*, std::unique_ptr<Methods>> known;
  const std::lock_guard lock(mutex);
  std::unique_ptr<Methods>& methods = known[real];
  if (methods == nullptr) {
    methods = std::make_unique<Methods>(Methods{*real, real});
    methods->replaced.xWrite = Write;
    methods->replaced.xRead = Read;
    methods->replaced.xSync = Sync;
    methods->replaced.xTruncate = Truncate;
    // Without it every access comes through the methods above.
    methods->replaced.xFetch = [](sqlite3_file*, sqlite3_int64, int, void** page) {
      *page = nullptr;
      return SQLITE_OK;
    };
  }
  return &methods->replaced;
}

sqlite3_vfs* real_vfs = nullptr;
sqlite3_vfs faulty_vfs;

int Open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  if (temporary_folder_is_full && (flags & SQLITE_OPEN_DELETEONCLOSE) != 0) return SQLITE_FULL;
  const int result = real_vfs->xOpen(real_vfs, name, file, flags, out_flags);
  if (result == SQLITE_OK) file->pMethods = Wrapped(file->pMethods);
  return result;
}

}  // namespace

FaultyDisk::FaultyDisk() {
  real_vfs = sqlite3_vfs_find(nullptr);
  faulty_vfs = *real_vfs;
  faulty_vfs.zName = "faulty";
  faulty_vfs.xOpen = Open;
  sqlite3_vfs_register(&faulty_vfs, 1);
}

FaultyDisk::~FaultyDisk() {
  Repair();
  ReleaseWrites();
  ReleaseReads();
  SetTemporaryFolderFull(false);
  sqlite3_vfs_unregister(&faulty_vfs);
  sqlite3_vfs_register(real_vfs, 1);
}

void FaultyDisk::FailAfter(int64_t count, DiskFault fault) {
  failed = false;
  disk_fault = fault;
  good_count = count;
}

bool FaultyDisk::Repair() {
  good_count = kNever;
  return failed;
}

void FaultyDisk::HoldWritesAfter(int64_t count) { latch.HoldAfter(count); }

bool FaultyDisk::AwaitHeldWrite() { return latch.AwaitHeld(); }

void FaultyDisk::ReleaseWrites() { latch.Release(); }

void FaultyDisk::SetTemporaryFolderFull(bool is_full) { temporary_folder_is_full = is_full; }

void FaultyDisk::HoldReadsOfThisThread() {
  read_latch.HoldAfter(0);
  holds_reads = true;
}

bool FaultyDisk::AwaitHeldRead() { return read_latch.AwaitHeld(); }

void FaultyDisk::ReleaseReads() { read_latch.Release(); }

}  // namespace carillon
