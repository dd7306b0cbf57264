// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/spool_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

absl::Status Failed(absl::string_view what) {
  const int error = errno;
  const std::string why = std::generic_category().message(error);
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return Refusal(absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
                   absl::StrCat("no space is left beside the database (", why,
                                "): free some, or delete models"));
  }
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("a temporary file beside the database cannot be ", what, " (", why,
                              "): see that this user may write in its folder"));
}

}  // namespace

absl::StatusOr<SpoolFile> SpoolFile::Make(const std::filesystem::path& folder,
                                          MakeSpace make_space) {
  std::string name = folder / "spool-XXXXXX";
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) return Failed("made");
  unlink(name.c_str());
  return SpoolFile(descriptor, std::move(make_space));
}

SpoolFile::~SpoolFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

absl::Status SpoolFile::Append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      absl::Status failed = Failed("written");
      if (absl::IsResourceExhausted(failed) && make_space_()) continue;
      return failed;
    }
    bytes.remove_prefix(static_cast<size_t>(written));
  }
  return absl::OkStatus();
}

absl::Status SpoolFile::Rewind() {
  return lseek(descriptor_, 0, SEEK_SET) == 0 ? absl::OkStatus() : Failed("read");
}

absl::StatusOr<std::string> SpoolFile::Read(size_t limit) {
  std::string bytes(limit, '\0');
  size_t got = 0;
  while (got < limit) {
    const ssize_t count = read(descriptor_, bytes.data() + got, limit - got);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Failed("read");
    if (count == 0) break;
    got += static_cast<size_t>(count);
  }
  bytes.resize(got);
  return bytes;
}

}  // namespace carillon
