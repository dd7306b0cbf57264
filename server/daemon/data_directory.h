// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// The daemon's folder, locked for the lifetime of this object, so that only one daemon at a time
/// uses it. Two locks are taken: on the file `lock`, which every version of the daemon respects,
/// and on the folder itself, because somebody may remove that file. The kernel releases both
/// however the process ends. File systems that cannot lock a folder, such as NFS, have the first
/// only.
class DataDirectory {
 public:
  static constexpr char kDatabaseName[] = "carillon.db";

  /// Checks whether Open could use or create the folder, and whether this user may change the files
  /// of the database there, without locking or creating anything. Errors: FailedPrecondition
  /// (DATABASE_UNUSABLE).
  static absl::Status Check(const std::filesystem::path& path);

  /// Locks the folder, for which it waits up to a second. Creates it, readable by its owner only,
  /// unless it exists. Errors: Unavailable (DATABASE_BUSY), FailedPrecondition (DATABASE_UNUSABLE).
  static absl::StatusOr<DataDirectory> Open(const std::filesystem::path& path);
  ~DataDirectory();
  DataDirectory(DataDirectory&& other) noexcept;
  DataDirectory& operator=(DataDirectory&&) = delete;

  /// Returns the database file. If it is a symbolic link, returns the file to which it leads,
  /// beside which SQLite has the log.
  std::filesystem::path database_file() const;
  /// The folder for the files of running decompositions in the data folder `path`.
  static std::filesystem::path WorkDirectory(const std::filesystem::path& path) {
    return path / "work";
  }

 private:
  DataDirectory(std::filesystem::path path, int folder, int file);

  std::filesystem::path path_;
  int folder_;  ///< a descriptor of the folder, locked
  int file_;    ///< a descriptor of the file `lock`, locked
};

}  // namespace carillon
