// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/private_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr size_t kMostBytes = 1 << 20;
/// Mode bits of a file that others may access or that the group may change.
constexpr mode_t kForbidden = 0027;

absl::Status Unusable(const std::string& path, absl::string_view reason, absl::string_view why) {
  return Refusal(absl::StatusCode::kFailedPrecondition, reason,
                 absl::StrCat("\"", path, "\" ", why));
}

absl::StatusOr<std::string> ReadAll(int file, const std::string& path, absl::string_view reason) {
  std::string content(kMostBytes, '\0');
  size_t size = 0;
  while (size < kMostBytes) {
    const ssize_t got = read(file, content.data() + size, kMostBytes - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      return Unusable(path, reason,
                      absl::StrCat("cannot be read: ", std::generic_category().message(errno)));
    }
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  if (size == 0 || size == kMostBytes) {
    return Unusable(path, reason, "is empty or over 1 MiB: name another file");
  }
  content.resize(size);
  return content;
}

absl::Status CheckPrivate(const struct stat& status, const std::string& path,
                          absl::string_view reason) {
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return Unusable(path, reason,
                    "belongs to another user, who could change it: give it to the daemon's user "
                    "with chown");
  }
  if ((status.st_mode & kForbidden) == 0) return absl::OkStatus();
  return Unusable(path, reason,
                  absl::StrFormat("has the mode %04o, by which other users can read or change it: "
                                  "run chmod 600 on it, and replace the secrets in it",
                                  status.st_mode & 07777U));
}

absl::StatusOr<std::string> ReadFile(const std::string& path, absl::string_view reason,
                                     bool is_private) {
  // Without O_NONBLOCK a named pipe would wait for a writer.
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) {
    const std::string why = std::generic_category().message(errno);
    const bool looks_like_shell = absl::StartsWith(path, "~") || absl::StrContains(path, "$");
    return Unusable(
        path, reason,
        absl::StrCat("cannot be opened: ", why,
                     looks_like_shell ? "; write the whole path, without ~ and $" : ""));
  }
  const absl::Cleanup close_file = [file] { close(file); };
  struct stat status {};
  if (fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) {
    return Unusable(path, reason, "is not a regular file: name another file");
  }
  if (is_private) RETURN_IF_ERROR(CheckPrivate(status, path, reason));
  return ReadAll(file, path, reason);
}

}  // namespace

absl::StatusOr<std::string> ReadPrivateFile(const std::string& path, absl::string_view reason) {
  return ReadFile(path, reason, true);
}

absl::StatusOr<std::string> ReadPublicFile(const std::string& path, absl::string_view reason) {
  return ReadFile(path, reason, false);
}

}  // namespace carillon
