// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon::client {

/// A file that appears under its name only when it is complete. Until then its bytes are in a file
/// beside it that only this user may read and write (mode 0600), and an older file
/// of the name stays unchanged. Devices, pipes and paths in /dev and /proc get their bytes at
/// once.
class WholeFile {
 public:
  /// Begins to write the file. If `path` is a symbolic link, the file to which the link points is
  /// written. Errors: Internal (OUTPUT_NOT_WRITABLE), FailedPrecondition (the same: the file
  /// is the database of a daemon, or belongs to such a database).
  static absl::StatusOr<WholeFile> Create(const std::string& path);

  /// Removes the bytes that were written, unless Publish has succeeded.
  ~WholeFile();
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;

  /// Appends bytes. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Write(absl::string_view bytes);

  /// Waits until the bytes are on the disk, and gives the file its name. Errors: Internal
  /// (OUTPUT_NOT_WRITABLE).
  absl::Status Publish();

 private:
  WholeFile(std::string path, std::string final_path);

  /// Opens the file beside the final one.
  absl::Status OpenBeside();
  /// Gives the file a name beside the final one, because a rename, in contrast to a link, can
  /// replace a file.
  absl::Status NameBeside();
  absl::Status Failed(int error) const;

  std::string path_;        ///< as the caller wrote it
  std::string final_path_;  ///< without symbolic links; empty if the bytes are written at once
  std::string temporary_;   ///< empty while the file has no name
  int descriptor_ = -1;
};

}  // namespace carillon::client
