// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "absl/status/statusor.h"

namespace carillon {

/// The daemon's folder, held by one daemon at a time for as long as this lives (and no longer,
/// however it ends: the lock is the kernel's).
class DataDirectory {
 public:
  /// Makes the folder, for its owner only, where it is not there.
  /// Errors: FailedPrecondition (DATA_DIRECTORY_IN_USE, DATA_DIRECTORY_UNUSABLE).
  static absl::StatusOr<DataDirectory> Open(const std::filesystem::path& path);
  ~DataDirectory();
  DataDirectory(DataDirectory&& other) noexcept;
  DataDirectory& operator=(DataDirectory&&) = delete;

  std::filesystem::path database_file() const { return path_ / "carillon.db"; }
  /// For the files of running decompositions.
  std::filesystem::path work_directory() const { return path_ / "work"; }

 private:
  DataDirectory(std::filesystem::path path, int lock);

  std::filesystem::path path_;
  int lock_;
};

}  // namespace carillon
