// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <fstream>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr uintmax_t kMostReserveBytes = 16 << 20;
/// Space for the log of a deletion.
constexpr uintmax_t kLeastReserveBytes = 1 << 20;
/// The reserve takes at most a fourth of the free space.
constexpr uintmax_t kReservePart = 4;
constexpr char kBackupSuffix[] = "-backup-";

std::filesystem::path LogOf(const std::filesystem::path& file) { return file.string() + "-wal"; }

std::filesystem::path CountOf(const std::filesystem::path& file) {
  return file.string() + "-count";
}

}  // namespace

bool DatabaseFiles::IsWhole(const std::filesystem::path& file, std::optional<Seen>& seen,
                            WrittenFile& size) {
  bool is_same = false;
  const bool has_all = size.IsWhole([&]() -> int64_t {
    struct stat status {};
    const bool exists = stat(file.c_str(), &status) == 0;
    if (exists && !seen) seen = Seen{.device = status.st_dev, .inode = status.st_ino};
    is_same = exists ? seen->device == status.st_dev && seen->inode == status.st_ino : !seen;
    return exists ? status.st_size : std::numeric_limits<int64_t>::max();
  });
  return is_same && has_all;
}

absl::Status DatabaseFiles::Check() {
  const MutexLock lock(&mutex_);
  const bool has_database = IsWhole(file_, database_, sizes_.database());
  const bool has_log = IsWhole(LogOf(file_), log_, sizes_.log());
  const bool was_lost = std::exchange(lost_, lost_ || !has_database || !has_log);
  if (!lost_) return absl::OkStatus();
  if (!was_lost) LossMark(file_).Set();
  // The stop would copy a damaged log into the file.
  sizes_.database().Close();
  sizes_.log().Close();
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_LOST",
                 absl::StrCat("somebody removed, replaced, truncated or overwrote ", file_.string(),
                              " or its -wal file while the daemon ran, so that nothing can be "
                              "stored any more: stop the daemon, put the files back or run "
                              "carillond db restore, and start it again"));
}

absl::Status DatabaseFiles::Change(absl::FunctionRef<absl::Status()> work) {
  RETURN_IF_ERROR(Check());
  absl::Status worked = work();
  RETURN_IF_ERROR(Check());
  return worked;
}

LossMark::LossMark(const std::filesystem::path& file) : file_(file.string() + "-lost") {}

void LossMark::Set() const { std::ofstream{file_}; }

bool LossMark::IsSet() const {
  std::error_code error;
  return std::filesystem::exists(file_, error);
}

void LossMark::Remove() const {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

ChangeCount::ChangeCount(const std::filesystem::path& file)
    : descriptor_(open(CountOf(file).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {}

ChangeCount::~ChangeCount() {
  if (descriptor_ >= 0) close(descriptor_);
}

int64_t ChangeCount::Read() const {
  std::array<char, 20> text{};
  const ssize_t size = pread(descriptor_, text.data(), text.size(), 0);
  int64_t count = 0;
  if (size > 0) std::from_chars(text.data(), text.data() + size, count);
  return count;
}

/// A count that cannot be written stays behind, which does no harm.
void ChangeCount::Write(int64_t count) const {
  const std::string text = absl::StrFormat("%-19d\n", count);
  [[maybe_unused]] const ssize_t written = pwrite(descriptor_, text.data(), text.size(), 0);
}

DiskReserve::DiskReserve(const std::filesystem::path& file) : file_(file.string() + "-reserve") {}

uintmax_t DiskReserve::SizeOn(uintmax_t free_bytes) {
  if (free_bytes < 2 * kLeastReserveBytes) return 0;
  return std::clamp(free_bytes / kReservePart, kLeastReserveBytes, kMostReserveBytes);
}

void DiskReserve::Take() const {
  std::error_code error;
  uintmax_t had = std::filesystem::file_size(file_, error);
  if (error) had = 0;
  if (had >= kMostReserveBytes) return;
  const std::filesystem::space_info space = std::filesystem::space(file_.parent_path(), error);
  const uintmax_t wanted = error ? 0 : SizeOn(space.available + had);
  if (wanted <= had) return;
  const int made = open(file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (made < 0) return;
  if (posix_fallocate(made, 0, static_cast<off_t>(wanted)) != 0) Release();
  close(made);
}

void DiskReserve::Release() const {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

std::filesystem::path NewBackupFile(const std::filesystem::path& file) {
  static std::atomic<int> count = 0;
  return absl::StrCat(file.string(), kBackupSuffix, ++count);
}

void RemoveUnfinishedBackups(const std::filesystem::path& file) {
  const std::string prefix = file.filename().string() + kBackupSuffix;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(file.parent_path(), error)) {
    if (!absl::StartsWith(entry.path().filename().string(), prefix)) continue;
    std::filesystem::remove(entry.path(), error);
  }
}

}  // namespace carillon
