// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/clips/clip_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kWorkPrefix[] = ".work-";
constexpr char kLockName[] = ".lock";

absl::Status NotWritable(const fs::path& path, const std::string& why) {
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path.string(), ": ", why, "; choose another folder"));
}

void RemoveWhatOthersLeft(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> left;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (absl::StartsWith(entry.path().filename().string(), kWorkPrefix)) left.push_back(entry);
  }
  for (const fs::path& path : left) {
    if (FileLock::Take(path / kLockName, false).holds()) fs::remove_all(path, ignored);
  }
}

std::string TextOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

absl::StatusOr<std::vector<std::string>> ListTraces(const fs::path& folder) {
  std::error_code error;
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".contacts") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  if (!names.empty() && !error) return names;
  return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                 absl::StrCat(folder.string(), ": ", error ? error.message() : "has no *.contacts",
                              "; name a folder of contact traces"));
}

FileLock::FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock& FileLock::operator=(FileLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

FileLock FileLock::Take(const fs::path& path, bool waits) {
  FileLock lock;
  lock.descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock.descriptor_ < 0) return lock;
  int refused = 0;
  do {
    refused = flock(lock.descriptor_, waits ? LOCK_EX : LOCK_EX | LOCK_NB);
  } while (refused != 0 && errno == EINTR);
  return refused == 0 ? std::move(lock) : FileLock();
}

absl::StatusOr<ClipFolder> ClipFolder::Open(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  const FileLock lock = FileLock::Take(path / kLockName, true);
  if (!lock.holds()) return NotWritable(path, error ? error.message() : std::strerror(errno));
  RemoveWhatOthersLeft(path);
  std::string work = (path / kWorkPrefix).string() + "XXXXXX";
  if (mkdtemp(work.data()) == nullptr) return NotWritable(path, std::strerror(errno));
  // Nobody else sees the new folder before `lock` is given back.
  FileLock own = FileLock::Take(fs::path(work) / kLockName, true);
  if (!own.holds()) return NotWritable(work, std::strerror(errno));
  return ClipFolder(path, work, std::move(own));
}

ClipFolder::ClipFolder(fs::path path, fs::path work, FileLock lock)
    : path_(std::move(path)), work_(std::move(work)), lock_(std::move(lock)) {}

ClipFolder::~ClipFolder() {
  if (!lock_.holds()) return;  // moved from
  std::error_code ignored;
  fs::remove_all(work_, ignored);
}

fs::path ClipFolder::Work(const std::string& file) const {
  std::error_code ignored;  // the file itself will fail
  fs::create_directories((work_ / file).parent_path(), ignored);
  return work_ / file;
}

absl::Status ClipFolder::Publish(const std::string& file) const {
  std::error_code error;
  if (fs::is_directory(work_ / file)) fs::remove_all(path_ / file, error);
  fs::rename(work_ / file, path_ / file, error);
  // Another process may have put the same folder there since.
  if (error && fs::is_directory(path_ / file)) return absl::OkStatus();
  return error ? NotWritable(path_ / file, error.message()) : absl::OkStatus();
}

absl::Status ClipFolder::Write(const std::string& file, const std::string& text) const {
  std::ofstream written(Work(file), std::ios::binary | std::ios::trunc);
  written << text;
  written.close();
  if (!written) return NotWritable(path_ / file, std::strerror(errno));
  return Publish(file);
}

absl::Status ClipFolder::WriteManifest(std::span<const std::string> clips) const {
  // Who finishes last gets the lock last, and then finds the records of all.
  const FileLock lock = FileLock::Take(path_ / kLockName, true);
  if (!lock.holds()) return NotWritable(path_ / kLockName, std::strerror(errno));
  std::string text;
  for (const std::string& clip : clips) text += TextOf(path_ / absl::StrCat(clip, ".json"));
  return Write("manifest.jsonl", text);
}

}  // namespace carillon::cli
