// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "absl/status/statusor.h"

namespace carillon {

/// The daemon's folder, locked for the lifetime of this object, so that only one daemon at a time
/// uses it. The kernel releases the lock however the process ends.
class DataDirectory {
 public:
  /// Locks the folder, for which it waits up to a second. Creates it, readable by its owner only,
  /// unless it exists. Errors: FailedPrecondition (DATA_DIRECTORY_IN_USE, DATA_DIRECTORY_UNUSABLE).
  static absl::StatusOr<DataDirectory> Open(const std::filesystem::path& path);
  ~DataDirectory();
  DataDirectory(DataDirectory&& other) noexcept;
  DataDirectory& operator=(DataDirectory&&) = delete;

  std::filesystem::path database_file() const { return path_ / "carillon.db"; }
  /// The folder for the files of running decompositions.
  std::filesystem::path work_directory() const { return path_ / "work"; }

 private:
  DataDirectory(std::filesystem::path path, int lock);

  std::filesystem::path path_;
  int lock_;
};

}  // namespace carillon
