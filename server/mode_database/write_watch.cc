// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/write_watch.h"

#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

std::string NewName() {
  static std::atomic<int> count = 0;
  return absl::StrCat("carillon-", ++count);
}

/// The log's index, which all processes that use SQLite on the database share in memory. Whoever
/// changes the log, or copies it into the database, holds a lock meanwhile and changes the header.
class LogIndex {
 public:
  LogIndex(MappingGuard& guard, WrittenFile& database, WrittenFile& log)
      : guard_(guard), database_(database), log_(log) {}

  /// Notes that SQLite has mapped a piece of the index into memory.
  void Map(int region, volatile void* mapped, int size) {
    guard_.Guard(mapped, static_cast<size_t>(size));
    if (region == 0 && size >= kHeaderBytes) header_ = static_cast<volatile char*>(mapped);
  }

  void Unmap() {
    guard_.Release();
    header_ = nullptr;
    seen_log_.clear();
    seen_copies_.clear();
    copied_salts_.clear();
  }

  /// Compares the header, after this process has got a lock of writers, with that of its last
  /// Leave, and returns whether the database `file` has the first bytes that SQLite wrote.
  bool Enter(sqlite3_file& file) {
    if (header_ == nullptr) return true;
    if (HasFewerFrames()) {
      log_.Close();
      return false;
    }
    if (Log() != seen_log_) log_.ForgetHead();
    if (Copies() != seen_copies_ || IsBeingCopied()) database_.ForgetHead();
    copied_salts_ = IsCopied() ? Salts(Log()) : "";
    return HasHead(file);
  }

  /// Remembers the header, before this process gives back the lock of changes to the log. Looks at
  /// the database `file` again, because somebody may have overwritten it during the change.
  void LeaveLog(sqlite3_file& file) {
    if (header_ == nullptr) return;
    seen_log_ = Log();
    if (HasBegunAnew()) seen_copies_ = Copies();
    if (Copies() == seen_copies_) {
      HasHead(file);
      return;
    }
    // Another process has copied the log meanwhile.
    database_.TakeHead(file);
    seen_copies_ = Copies();
  }

  /// Remembers the header, before this process gives back the lock of copies into the database.
  void LeaveCopies() {
    if (header_ != nullptr) seen_copies_ = Copies();
  }

 private:
  bool HasHead(sqlite3_file& file) {
    return database_.HasHead(file, [&] {
      // Whoever copies the log changes the header before the database.
      file.pMethods->xShmBarrier(&file);
      return Copies() == seen_copies_ && !IsBeingCopied();
    });
  }

  std::string Bytes(int begin, int end) const {
    std::string bytes(end - begin, '\0');
    std::copy(header_ + begin, header_ + end, bytes.begin());
    return bytes;
  }

  // https://www.sqlite.org/walformat.html#the_wal_index_file_format: two copies of a header that
  // changes with every change of the log.
  std::string Log() const { return Bytes(0, 96); }

  /// Whether the log has fewer frames than at the last Leave and was not begun anew, as in an older
  /// copy of the index. SQLite would overwrite the frames that are missing in it.
  bool HasFewerFrames() const {
    const std::string now = Log();
    return !seen_log_.empty() && Salts(now) == Salts(seen_log_) &&
           FrameCount(now) < FrameCount(seen_log_);
  }

  /// Returns the number of frames in a log with this header, which has the machine's byte order.
  static uint32_t FrameCount(const std::string& header) {
    uint32_t count = 0;
    std::memcpy(&count, header.data() + 16, sizeof(count));
    return count;
  }

  /// Returns the salts of a log with this header. A log that is begun anew has others.
  static std::string Salts(const std::string& header) { return header.substr(32, 8); }

  /// The number of frames that were copied into the database, and of those that somebody has begun
  /// to copy.
  std::string Copied() const { return Bytes(96, 100); }
  std::string BegunToCopy() const { return Bytes(128, kHeaderBytes); }

  /// Bytes that change with every copy of the log into the database.
  std::string Copies() const { return absl::StrCat(Salts(Log()), Copied(), BegunToCopy()); }

  /// Whether a process copies the log into the database now, or was killed while it did.
  bool IsBeingCopied() const { return Copied() != BegunToCopy(); }

  /// Whether the whole log was copied into the database.
  bool IsCopied() const { return !IsBeingCopied() && Copied() == Log().substr(16, 4); }

  /// Whether the change since Enter has begun the log anew, which it may if all of the log was in
  /// the database, and nobody has begun to copy the new log.
  bool HasBegunAnew() const {
    return !copied_salts_.empty() && Salts(Log()) != copied_salts_ && !IsBeingCopied() &&
           Copied() == std::string(4, '\0');
  }

  static constexpr int kHeaderBytes = 132;

  MappingGuard& guard_;
  WrittenFile& database_;
  WrittenFile& log_;
  volatile char* header_ = nullptr;
  std::string seen_log_;
  std::string seen_copies_;
  /// Salts of the log at the last Enter, if the whole log was in the database; else empty.
  std::string copied_salts_;
};

/// A file of SQLite that is watched. SQLite's own file lies behind it in memory.
struct WatchedFile {
  sqlite3_file base;
  WrittenFile* written;
  LogIndex* index;
};

sqlite3_file& Real(sqlite3_file* file) {
  return *reinterpret_cast<sqlite3_file*>(reinterpret_cast<WatchedFile*>(file) + 1);
}

WrittenFile& WrittenOf(sqlite3_file* file) {
  return *reinterpret_cast<WatchedFile*>(file)->written;
}

/// Calls a method of SQLite's own file.
template <auto kMethod, typename... Arguments>
auto Forward(sqlite3_file* file, Arguments... arguments) {
  sqlite3_file& real = Real(file);
  return (real.pMethods->*kMethod)(&real, arguments...);
}

int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
  return WrittenOf(file).Write(Real(file), data, size, offset);
}

int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  return WrittenOf(file).Truncate(Real(file), size);
}

LogIndex& IndexOf(sqlite3_file* file) { return *reinterpret_cast<WatchedFile*>(file)->index; }

int MapIndex(sqlite3_file* file, int region, int size, int extend, volatile void** mapped) {
  sqlite3_file& real = Real(file);
  const int result = real.pMethods->xShmMap(&real, region, size, extend, mapped);
  if (result == SQLITE_OK && *mapped != nullptr) {
    IndexOf(file).Map(region, *mapped, size);
  }
  return result;
}

int UnmapIndex(sqlite3_file* file, int remove) {
  IndexOf(file).Unmap();
  sqlite3_file& real = Real(file);
  return real.pMethods->xShmUnmap(&real, remove);
}

int LockIndex(sqlite3_file* file, int offset, int count, int flags) {
  constexpr int kLockOfLog = 0;
  constexpr int kLockOfCopies = 1;
  sqlite3_file& real = Real(file);
  const auto lock = [&](int how) { return real.pMethods->xShmLock(&real, offset, count, how); };
  if (offset > kLockOfCopies || (flags & SQLITE_SHM_EXCLUSIVE) == 0) return lock(flags);
  LogIndex& index = IndexOf(file);
  if ((flags & SQLITE_SHM_UNLOCK) != 0) {
    offset == kLockOfLog ? index.LeaveLog(real) : index.LeaveCopies();
    return lock(flags);
  }
  const int result = lock(flags);
  if (result != SQLITE_OK || index.Enter(real)) return result;
  lock(SQLITE_SHM_UNLOCK | SQLITE_SHM_EXCLUSIVE);
  return SQLITE_IOERR_SHMLOCK;
}

using Io = sqlite3_io_methods;
const Io kWatched = {.iVersion = 3,
                     .xClose = Forward<&Io::xClose>,
                     .xRead = Forward<&Io::xRead>,
                     .xWrite = Write,
                     .xTruncate = Truncate,
                     .xSync = Forward<&Io::xSync>,
                     .xFileSize = Forward<&Io::xFileSize>,
                     .xLock = Forward<&Io::xLock>,
                     .xUnlock = Forward<&Io::xUnlock>,
                     .xCheckReservedLock = Forward<&Io::xCheckReservedLock>,
                     .xFileControl = Forward<&Io::xFileControl>,
                     .xSectorSize = Forward<&Io::xSectorSize>,
                     .xDeviceCharacteristics = Forward<&Io::xDeviceCharacteristics>,
                     .xShmMap = MapIndex,
                     .xShmLock = LockIndex,
                     .xShmBarrier = Forward<&Io::xShmBarrier>,
                     .xShmUnmap = UnmapIndex,
                     .xFetch = Forward<&Io::xFetch>,
                     .xUnfetch = Forward<&Io::xUnfetch>};

/// Returns a file's size. A file whose size cannot be told counts as whole, because the write that
/// follows fails by itself.
int64_t SizeNow(sqlite3_file& file) {
  sqlite3_int64 byte_count = 0;
  const bool told = file.pMethods->xFileSize(&file, &byte_count) == SQLITE_OK;
  return told ? byte_count : INT64_MAX;
}

constexpr int64_t kHeadBytes = 100;

/// Returns a file's first bytes, or nothing if they cannot be read.
std::optional<std::string> HeadNow(sqlite3_file& file, int64_t byte_count) {
  std::string head(byte_count, '\0');
  const int result = file.pMethods->xRead(&file, head.data(), static_cast<int>(byte_count), 0);
  if (result != SQLITE_OK && result != SQLITE_IOERR_SHORT_READ) return std::nullopt;
  return head;
}

}  // namespace

void WrittenFile::Open(sqlite3_file& file) {
  const MutexLock lock(&mutex_);
  byte_count_ = SizeNow(file);
  ReadHead(file);
}

void WrittenFile::ReadHead(sqlite3_file& file) {
  head_ = HeadNow(file, std::min(SizeNow(file), kHeadBytes)).value_or("");
  knows_head_ = true;
}

void WrittenFile::TakeHead(sqlite3_file& file) {
  const MutexLock lock(&mutex_);
  ReadHead(file);
}

/// A file that cannot be read counts as unchanged, because what SQLite does next fails by itself.
bool WrittenFile::HasHead(sqlite3_file& file, absl::FunctionRef<bool()> must_be_ours) {
  const MutexLock lock(&mutex_);
  if (!knows_head_) ReadHead(file);
  if (HeadNow(file, std::ssize(head_)).value_or(head_) == head_) return !lost_;
  knows_head_ = must_be_ours();
  lost_ = lost_ || knows_head_;
  return !lost_;
}

void WrittenFile::NoteHead(const void* data, int size, int64_t offset) {
  if (offset >= kHeadBytes) return;
  const int64_t end = std::min(offset + size, kHeadBytes);
  head_.resize(std::max<size_t>(head_.size(), end), '\0');
  std::memcpy(head_.data() + offset, data, end - offset);
}

void WrittenFile::ForgetHead() {
  const MutexLock lock(&mutex_);
  knows_head_ = false;
}

bool WrittenFile::IsWhole(absl::FunctionRef<int64_t()> look) {
  const MutexLock lock(&mutex_);
  lost_ = lost_ || index_.was_truncated() || look() < byte_count_;
  return !lost_;
}

void WrittenFile::Close() {
  const MutexLock lock(&mutex_);
  lost_ = true;
}

int WrittenFile::Write(sqlite3_file& file, const void* data, int size, int64_t offset) {
  const auto has_lock = [] { return true; };
  if (!IsWhole([&file] { return SizeNow(file); }) || !HasHead(file, has_lock)) {
    return SQLITE_IOERR_WRITE;
  }
  const int result = file.pMethods->xWrite(&file, data, size, offset);
  const MutexLock lock(&mutex_);
  if (result != SQLITE_OK) {
    // A part of the data may have been written.
    if (offset < kHeadBytes) ReadHead(file);
    return result;
  }
  byte_count_ = std::max<int64_t>(byte_count_, offset + size);
  NoteHead(data, size, offset);
  return result;
}

int WrittenFile::Truncate(sqlite3_file& file, int64_t byte_count) {
  // Under the lock, IsWhole sees the new size of the file together with the new count.
  const MutexLock lock(&mutex_);
  if (lost_ || index_.was_truncated()) return SQLITE_IOERR_TRUNCATE;
  byte_count_ = std::min(byte_count_, byte_count);
  head_.resize(std::min<size_t>(head_.size(), byte_count));
  return file.pMethods->xTruncate(&file, byte_count);
}

int64_t WrittenFile::byte_count() const {
  const MutexLock lock(&mutex_);
  return byte_count_;
}

struct WriteWatch::Layer {
  explicit Layer(WriteWatch& watch)
      : real(*sqlite3_vfs_find(nullptr)),
        vfs(real),
        database(watch.database_),
        log(watch.log_),
        index(watch.index_, watch.database_, watch.log_) {
    vfs.zName = watch.name_.c_str();
    vfs.pAppData = this;
    vfs.szOsFile += static_cast<int>(sizeof(WatchedFile));
    vfs.xOpen = Open;
    sqlite3_vfs_register(&vfs, 0);
  }
  ~Layer() { sqlite3_vfs_unregister(&vfs); }
  Layer(const Layer&) = delete;
  Layer& operator=(const Layer&) = delete;

  static int Open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* opened) {
    Layer& layer = *static_cast<Layer*>(vfs->pAppData);
    const bool is_database = (flags & SQLITE_OPEN_MAIN_DB) != 0;
    if (!is_database && (flags & SQLITE_OPEN_WAL) == 0) {
      return layer.real.xOpen(&layer.real, name, file, flags, opened);
    }
    sqlite3_file& real = Real(file);
    file->pMethods = nullptr;
    const int result = layer.real.xOpen(&layer.real, name, &real, flags, opened);
    if (real.pMethods == nullptr) return result;
    WrittenFile& written = is_database ? layer.database : layer.log;
    file->pMethods = &kWatched;
    reinterpret_cast<WatchedFile*>(file)->written = &written;
    reinterpret_cast<WatchedFile*>(file)->index = &layer.index;
    if (result == SQLITE_OK) written.Open(real);
    return result;
  }

  sqlite3_vfs& real;
  sqlite3_vfs vfs;
  WrittenFile& database;
  WrittenFile& log;
  LogIndex index;
};

WriteWatch::WriteWatch() : name_(NewName()), layer_(std::make_unique<Layer>(*this)) {}
WriteWatch::~WriteWatch() = default;

}  // namespace carillon
