// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon {

/// A nameless temporary file for data that arrives slowly and is then stored in one transaction.
/// The system deletes the file when the object or the process ends. Only one thread at a time may
/// use an object.
class SpoolFile {
 public:
  /// Frees space on the disk. Returns whether it freed any.
  using MakeSpace = std::function<bool()>;

  /// Makes a file in `folder`. The file calls `make_space` whenever the disk is full. Errors:
  /// FailedPrecondition (DATABASE_UNUSABLE: the folder cannot be written).
  static absl::StatusOr<SpoolFile> Make(const std::filesystem::path& folder, MakeSpace make_space);
  SpoolFile(SpoolFile&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)),
        make_space_(std::move(other.make_space_)) {}
  SpoolFile& operator=(SpoolFile&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(make_space_, other.make_space_);
    return *this;
  }
  ~SpoolFile();

  /// Appends bytes. Errors: ResourceExhausted (DATABASE_FULL: no space is left, and none can be
  /// made).
  absl::Status Append(std::string_view bytes);

  /// Goes back to the first byte.
  absl::Status Rewind();

  /// Returns the next `limit` bytes, or fewer at the end.
  absl::StatusOr<std::string> Read(size_t limit);

  int descriptor() const { return descriptor_; }

 private:
  SpoolFile(int descriptor, MakeSpace make_space)
      : descriptor_(descriptor), make_space_(std::move(make_space)) {}

  int descriptor_;
  MakeSpace make_space_;
};

}  // namespace carillon
