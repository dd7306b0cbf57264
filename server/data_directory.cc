// SPDX-License-Identifier: Apache-2.0
#include "server/data_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
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
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATA_DIRECTORY_UNUSABLE",
                 absl::StrCat("\"", path.string(),
                              "\" cannot be used: ", std::generic_category().message(error),
                              "; choose another with --data-dir"));
}

/// A worker that a killed daemon was just starting holds the lock until it runs its own program.
bool LockWithinASecond(int lock) {
  for (int tries = 20; flock(lock, LOCK_EX | LOCK_NB) != 0; --tries) {
    if (tries == 0) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

}  // namespace

absl::StatusOr<DataDirectory> DataDirectory::Open(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::absolute(path).parent_path(), error);
  if (mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return Unusable(path, errno);
  const int lock = open((path / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return Unusable(path, errno);
  if (LockWithinASecond(lock)) return DataDirectory(path, lock);
  close(lock);
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATA_DIRECTORY_IN_USE",
                 absl::StrCat("another daemon uses \"", path.string(),
                              "\"; stop it, or choose another folder with --data-dir"));
}

DataDirectory::DataDirectory(std::filesystem::path path, int lock)
    : path_(std::move(path)), lock_(lock) {}

DataDirectory::DataDirectory(DataDirectory&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

DataDirectory::~DataDirectory() {
  if (lock_ >= 0) close(lock_);
}

}  // namespace carillon
