// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// A nameless temporary file for data that arrives slowly and is then stored in one transaction.
/// The system deletes the file when the object or the process ends. One thread at a time.
class SpoolFile {
 public:
  /// Makes a file in `folder`. Errors: FailedPrecondition (DATABASE_UNUSABLE: the folder cannot be
  /// written).
  static absl::StatusOr<SpoolFile> Make(const std::filesystem::path& folder);
  SpoolFile(SpoolFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  SpoolFile& operator=(SpoolFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~SpoolFile();

  /// Appends bytes. Errors: ResourceExhausted (DATABASE_FULL: no space left).
  absl::Status Append(std::string_view bytes);

  /// Goes back to the first byte.
  absl::Status Rewind();

  /// Returns the next `limit` bytes, or fewer at the end.
  absl::StatusOr<std::string> Read(size_t limit);

  int descriptor() const { return descriptor_; }

 private:
  explicit SpoolFile(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
};

}  // namespace carillon
