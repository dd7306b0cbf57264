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

#include "absl/algorithm/container.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr uintmax_t kMostReserveBytes = 16 << 20;
/// Space for the log of a deletion.
constexpr uintmax_t kLeastReserveBytes = 1 << 20;
/// The reserve takes at most a fourth of the free space.
constexpr uintmax_t kReservePart = 4;
constexpr char kUnfinishedSuffix[] = "-unfinished-";

std::filesystem::path LogOf(const std::filesystem::path& file) { return file.string() + "-wal"; }

std::filesystem::path CountOf(const std::filesystem::path& file) {
  return file.string() + "-count";
}

/// Whether `name` is that of an unfinished copy of the database `file`, or of a file that SQLite or
/// the daemon keeps beside such a copy. An operator may give other names.
bool IsUnfinishedCopy(absl::string_view name, const std::string& file) {
  constexpr std::array<absl::string_view, 7> kSuffixes = {"",       "-wal",     "-shm", "-journal",
                                                          "-count", "-reserve", "-lost"};
  if (!absl::ConsumePrefix(&name, file + kUnfinishedSuffix)) return false;
  if (absl::ConsumePrefix(&name, "backup-")) {
    name.remove_prefix(std::min(name.find_first_not_of("0123456789"), name.size()));
  } else if (!absl::ConsumePrefix(&name, "restore") && !absl::ConsumePrefix(&name, "repair")) {
    return false;
  }
  return absl::c_linear_search(kSuffixes, name);
}

absl::Status IsNoFile(const std::filesystem::path& file, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("the database ", file.string(), " cannot be opened: ", why));
}

}  // namespace

bool DatabaseFiles::IsWhole(const std::filesystem::path& file, std::optional<Seen>& seen,
                            WrittenFile& written) {
  bool is_same = false;
  const bool has_all = written.IsWhole([&]() -> int64_t {
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
  const bool has_database = IsWhole(file_, database_, writes_.database());
  const bool has_log = IsWhole(LogOf(file_), log_, writes_.log());
  const bool was_lost = std::exchange(lost_, lost_ || !has_database || !has_log);
  if (!lost_) return absl::OkStatus();
  if (!was_lost) LossMark(file_).Set();
  // The stop would copy a damaged log into the file.
  writes_.database().Close();
  writes_.log().Close();
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

absl::StatusOr<std::filesystem::path> FollowLinks(const std::filesystem::path& file) {
  using std::filesystem::file_type;
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(file, error);
  const bool is_link =
      std::filesystem::symlink_status(absolute, error).type() == file_type::symlink;
  const file_type type = std::filesystem::status(absolute, error).type();
  if (type != file_type::regular && is_link) {
    return IsNoFile(file,
                    "it is a symbolic link that leads to no file; mount the disk to which it "
                    "leads, or remove the link");
  }
  if (type != file_type::regular && type != file_type::not_found) {
    return IsNoFile(file, type == file_type::directory
                              ? "it is a folder; move it away"
                              : "it is not a file, or this user may not see it");
  }
  std::filesystem::path real = std::filesystem::weakly_canonical(absolute, error);
  if (error) return IsNoFile(file, error.message());
  return real;
}

std::filesystem::path UnfinishedCopy(const std::filesystem::path& file, const std::string& kind) {
  return absl::StrCat(file.string(), kUnfinishedSuffix, kind);
}

std::filesystem::path NewBackupFile(const std::filesystem::path& file) {
  static std::atomic<int> count = 0;
  return UnfinishedCopy(file, absl::StrCat("backup-", ++count));
}

void RemoveUnfinishedCopies(const std::filesystem::path& file) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(file.parent_path(), error)) {
    if (!IsUnfinishedCopy(entry.path().filename().string(), file.filename().string())) continue;
    std::filesystem::remove(entry.path(), error);
  }
}

}  // namespace carillon
