// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/database_files.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <string>
#include <system_error>
#include <utility>

#include "absl/algorithm/container.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr uintmax_t kMostReserveBytes = 16 << 20;
/// Space for the log of a deletion.
constexpr uintmax_t kLeastReserveBytes = 1 << 20;
/// The reserve takes at most a fourth of the free space.
constexpr uintmax_t kReservePart = 4;
constexpr char kUnfinishedSuffix[] = "-unfinished-";

/// Whether `name` is that of an unfinished copy of the database `file`, or of a file that SQLite or
/// the daemon keeps beside such a copy. An operator may give other names.
bool IsUnfinishedCopy(absl::string_view name, const std::string& file) {
  constexpr std::array<absl::string_view, 5> kSuffixes = {"", "-wal", "-shm", "-journal",
                                                          "-reserve"};
  if (!absl::ConsumePrefix(&name, file + kUnfinishedSuffix)) return false;
  if (absl::ConsumePrefix(&name, "backup-")) {
    name.remove_prefix(std::min(name.find_first_not_of("0123456789"), name.size()));
  } else if (!absl::ConsumePrefix(&name, "restore")) {
    return false;
  }
  return absl::c_linear_search(kSuffixes, name);
}

absl::Status IsNoFile(const std::filesystem::path& file, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("the database ", file.string(), " cannot be opened: ", why));
}

}  // namespace

std::filesystem::path LogOf(const std::filesystem::path& file) { return file.string() + "-wal"; }

absl::Status FileWatch::Check() {
  const MutexLock lock(&mutex_);
  struct stat now {};
  const bool exists = stat(file_.c_str(), &now) == 0;
  if (exists && !seen_) seen_ = {now.st_dev, now.st_ino};
  lost_ = lost_ || !exists || seen_ != std::pair(now.st_dev, now.st_ino);
  return lost_ ? Lost() : absl::OkStatus();
}

absl::Status FileWatch::Lose() {
  const MutexLock lock(&mutex_);
  lost_ = true;
  return Lost();
}

absl::Status FileWatch::Lost() const {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_LOST",
                 absl::StrCat("somebody removed, replaced or truncated ", file_.string(),
                              " while the daemon ran, so that nothing can be stored any more: stop "
                              "the daemon, put the file back or run carillond db restore, and "
                              "start it again"));
}

std::string NetworkFileSystem(int64_t magic) {
  switch (magic) {
    case NFS_SUPER_MAGIC:
      return "NFS";
    case SMB_SUPER_MAGIC:
    case CIFS_SUPER_MAGIC:
    case SMB2_SUPER_MAGIC:
      return "SMB";
    default:
      return "";
  }
}

std::string NetworkFileSystemOf(const std::filesystem::path& file) {
  struct statfs found {};
  return statfs(file.c_str(), &found) == 0 ? NetworkFileSystem(found.f_type) : "";
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
