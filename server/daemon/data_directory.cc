// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/data_directory.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

absl::Status Unusable(const std::filesystem::path& path, int error) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("\"", path.string(),
                              "\" cannot be used: ", std::generic_category().message(error),
                              "; choose another with --data-dir"));
}

absl::Status InUse(const std::filesystem::path& path) {
  return Refusal(absl::StatusCode::kUnavailable, "DATABASE_BUSY",
                 absl::StrCat("another daemon uses \"", path.string(),
                              "\"; stop it, or choose another folder with --data-dir"));
}

bool TryLock(int descriptor) { return flock(descriptor, LOCK_EX | LOCK_NB) == 0; }

/// Returns whether nobody else has locked the folder. A file system that cannot lock folders leaves
/// the protection to the file `lock`.
bool TryLockFolder(int folder) { return TryLock(folder) || errno != EWOULDBLOCK; }

/// A worker that a killed daemon was just starting holds the locks until it runs its own program.
bool LockWithinASecond(int folder, int file) {
  for (int tries = 20; !(TryLockFolder(folder) && TryLock(file)); --tries) {
    if (tries == 0) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

/// Whether the path lies in a file system of the kernel, in which nobody can make a folder, though
/// root seems to be allowed to.
bool IsOfKernel(const std::filesystem::path& path) {
  struct statfs found {};
  return statfs(path.c_str(), &found) == 0 &&
         (found.f_type == PROC_SUPER_MAGIC || found.f_type == SYSFS_MAGIC);
}

/// Checks that this user may change the files that are there.
absl::Status CheckFiles(const std::filesystem::path& folder) {
  const std::string database = DataDirectory::kDatabaseName;
  for (const std::string& name :
       {std::string("lock"), database, database + "-wal", database + "-shm"}) {
    const std::filesystem::path file = folder / name;
    if (faccessat(AT_FDCWD, file.c_str(), R_OK | W_OK, AT_EACCESS) == 0 || errno == ENOENT) {
      continue;
    }
    return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                   absl::StrCat("\"", file.string(),
                                "\" cannot be used: ", std::generic_category().message(errno),
                                "; see that this user may read and write it"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status DataDirectory::Check(const std::filesystem::path& path) {
  // The folder that is there, or in which Open makes the missing ones.
  std::filesystem::path folder = std::filesystem::absolute(path);
  std::error_code ignored;
  while (!std::filesystem::exists(folder, ignored) && folder.has_relative_path()) {
    folder = folder.parent_path();
  }
  if (!std::filesystem::is_directory(folder, ignored)) return Unusable(path, ENOTDIR);
  if (faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
    return Unusable(path, errno);
  }
  return IsOfKernel(folder) ? Unusable(path, EROFS) : CheckFiles(path);
}

absl::StatusOr<DataDirectory> DataDirectory::Open(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::absolute(path).parent_path(), error);
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return Unusable(path, errno);
  const int folder = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return Unusable(path, errno);
  const int file = open((path / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  const int reason = errno;
  DataDirectory directory(path, folder, file);
  if (file < 0) return Unusable(path, reason);
  if (!LockWithinASecond(folder, file)) return InUse(path);
  return directory;
}

std::filesystem::path DataDirectory::database_file() const {
  std::filesystem::path file = path_ / kDatabaseName;
  std::error_code error;
  if (!std::filesystem::is_symlink(file, error)) return file;
  std::filesystem::path target = std::filesystem::weakly_canonical(file, error);
  return error ? file : target;
}

DataDirectory::DataDirectory(std::filesystem::path path, int folder, int file)
    : path_(std::move(path)), folder_(folder), file_(file) {}

DataDirectory::DataDirectory(DataDirectory&& other) noexcept
    : path_(std::move(other.path_)),
      folder_(std::exchange(other.folder_, -1)),
      file_(std::exchange(other.file_, -1)) {}

DataDirectory::~DataDirectory() {
  for (const int descriptor : {folder_, file_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

}  // namespace carillon
