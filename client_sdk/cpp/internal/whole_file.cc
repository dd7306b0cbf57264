// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

namespace fs = std::filesystem;

/// Suffixes of the files that belong to a database and have its name.
constexpr const char* kCompanions[] = {"-wal", "-shm", "-reserve", "-journal"};

/// Follows a database's name in the names of copies that are being made. The daemon removes them.
constexpr char kUnfinished[] = "-unfinished-";

absl::Status NotWritable(const std::string& path, absl::string_view why) {
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, " cannot be written: ", why, "; choose another file"));
}

absl::Status InUse(const std::string& path, const std::string& companion) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, " belongs to the database of a daemon, because ", companion,
                              " is beside it, and stays as it is: name another file"));
}

/// Refuses to replace a database of a daemon, or a file that belongs to one.
absl::Status CheckIsNoDatabase(const std::string& path, const std::string& final_path) {
  std::error_code ignored;
  // Whoever replaces the lock of a data folder lets a second daemon in.
  if (const fs::path database = fs::path(final_path).replace_filename("carillon.db");
      fs::path(final_path).filename() == "lock" && fs::exists(database, ignored)) {
    return InUse(path, database);
  }
  // The daemon removes the folder "work" when it starts.
  const fs::path folder = fs::path(final_path).parent_path();
  if (const fs::path database = fs::path(folder).replace_filename("carillon.db");
      folder.filename() == "work" && fs::exists(database, ignored)) {
    return InUse(path, database);
  }
  if (const size_t end = final_path.rfind(kUnfinished); end != std::string::npos) {
    const std::string database = final_path.substr(0, end);
    if (fs::exists(database, ignored)) return InUse(path, database);
  }
  for (const char* const companion : kCompanions) {
    const std::string beside = final_path + companion;
    if (fs::exists(beside, ignored)) return InUse(path, beside);
    absl::string_view database = final_path;
    if (!absl::ConsumeSuffix(&database, companion)) continue;
    if (fs::exists(fs::path(std::string(database)), ignored)) {
      return InUse(path, std::string(database));
    }
  }
  return absl::OkStatus();
}

/// Whether the path is the name of a file that a process has open, such as /dev/fd/1.
bool IsOpenFile(const fs::path& path) {
  std::error_code ignored;
  const std::string folder = fs::canonical(path.parent_path(), ignored).string();
  return absl::StartsWith(folder, "/proc/") && absl::EndsWith(folder, "/fd");
}

/// Follows symbolic links to a file, which need not exist, or to the name of a file that a process
/// has open.
fs::path Follow(const std::string& path) {
  std::error_code ignored;
  fs::path found = fs::absolute(path, ignored);
  // The system follows at most 40 links.
  for (int left = 40; left > 0 && fs::is_symlink(found, ignored) && !IsOpenFile(found); --left) {
    const fs::path target = fs::read_symlink(found, ignored);
    found = found.parent_path() / target;
  }
  const fs::path folder = fs::canonical(found.parent_path(), ignored);
  return folder.empty() ? found : folder / found.filename();
}

/// Returns the descriptor of the open file of this process that has the name `found`, or -1 if
/// there is none.
int OpenDescriptorOf(const fs::path& found) {
  int descriptor = -1;
  const bool is_own = found.parent_path() == absl::StrCat("/proc/", getpid(), "/fd");
  return is_own && absl::SimpleAtoi(found.filename().string(), &descriptor) ? descriptor : -1;
}

/// Flushes the entry of a new name to the disk.
void SyncFolder(const std::string& file) {
  const int folder = open(fs::path(file).parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  fsync(folder);
  close(folder);
}

}  // namespace

absl::StatusOr<WholeFile> WholeFile::Create(const std::string& path) {
  std::error_code ignored;
  const fs::file_type type = fs::status(path, ignored).type();
  if (type == fs::file_type::directory) return NotWritable(path, "it is a folder");
  const fs::path found = Follow(path);
  const bool has_place = type == fs::file_type::regular || type == fs::file_type::not_found;
  // A device or a pipe, or a file that a process has open, takes the bytes at once.
  WholeFile file(path, has_place && !IsOpenFile(found) ? found.string() : "");
  if (!file.final_path_.empty()) {
    RETURN_IF_ERROR(CheckIsNoDatabase(path, file.final_path_));
    RETURN_IF_ERROR(file.OpenBeside());
    return file;
  }
  if (const int opened = OpenDescriptorOf(found); opened >= 0) {
    // Opened anew, the file would lose what it has.
    RETURN_IF_ERROR(CheckIsNoDatabase(path, fs::read_symlink(found, ignored)));
    file.descriptor_ = fcntl(opened, F_DUPFD_CLOEXEC, 0);
  } else {
    file.descriptor_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  }
  if (file.descriptor_ < 0) return file.Failed(errno);
  return file;
}

WholeFile::WholeFile(std::string path, std::string final_path)
    : path_(std::move(path)), final_path_(std::move(final_path)) {}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : path_(std::move(other.path_)),
      final_path_(std::move(other.final_path_)),
      temporary_(std::exchange(other.temporary_, "")),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

WholeFile::~WholeFile() {
  if (descriptor_ >= 0) close(descriptor_);
  if (!temporary_.empty()) unlink(temporary_.c_str());
}

absl::Status WholeFile::OpenBeside() {
  const fs::path folder = fs::path(final_path_).parent_path();
  if (std::error_code ignored; !fs::exists(folder, ignored)) {
    return NotWritable(path_, absl::StrCat("the folder ", folder.string(), " does not exist"));
  }
  // If the process is killed, nothing remains of a file that has no name yet.
  descriptor_ = open(folder.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0600);
  if (descriptor_ >= 0) return absl::OkStatus();
  // Not every file system has files without a name.
  std::string name = final_path_ + ".XXXXXX";
  descriptor_ = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor_ < 0) return Failed(errno);
  temporary_ = name;
  return absl::OkStatus();
}

absl::Status WholeFile::NameBeside() {
  const std::string open_file = absl::StrCat("/proc/self/fd/", descriptor_);
  // A killed process may have left the first names.
  for (int i = 0; i < 100; ++i) {
    const std::string name = absl::StrCat(final_path_, ".", getpid(), "-", i);
    if (linkat(AT_FDCWD, open_file.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
      temporary_ = name;
      return absl::OkStatus();
    }
    if (errno != EEXIST) break;
  }
  return Failed(errno);
}

absl::Status WholeFile::Failed(int error) const {
  return NotWritable(path_, std::generic_category().message(error));
}

absl::Status WholeFile::Write(absl::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return Failed(errno);
    bytes.remove_prefix(static_cast<size_t>(written));
  }
  return absl::OkStatus();
}

absl::Status WholeFile::Publish() {
  if (final_path_.empty()) {
    return close(std::exchange(descriptor_, -1)) == 0 ? absl::OkStatus() : Failed(errno);
  }
  if (fsync(descriptor_) != 0) return Failed(errno);
  if (temporary_.empty()) RETURN_IF_ERROR(NameBeside());
  if (rename(temporary_.c_str(), final_path_.c_str()) != 0) return Failed(errno);
  temporary_.clear();
  SyncFolder(final_path_);
  return absl::OkStatus();
}

}  // namespace carillon::client
