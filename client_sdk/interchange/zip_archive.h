// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon::interchange {

/// A zip file that is read. One thread at a time.
class ZipReader {
 public:
  /// Errors: NotFound (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED).
  static absl::StatusOr<ZipReader> Open(const std::string& path);
  ZipReader(ZipReader&&) noexcept;
  ZipReader& operator=(ZipReader&&) noexcept;
  ~ZipReader();

  /// A file in it; nullopt where there is none of that name. Errors: InvalidArgument
  /// (MODEL_FILE_MALFORMED: damaged), ResourceExhausted (MODEL_FILE_TOO_LARGE: over 4 GiB).
  absl::StatusOr<std::optional<std::string>> Read(const std::string& name) const;

 private:
  struct State;
  explicit ZipReader(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

/// A file to be put into a zip file: two pieces of memory, one after the other.
struct ZipEntry {
  std::string name;
  std::string head;
  std::string_view body;
};

/// Writes a zip file without compression, under another name first, so that `path` never holds half
/// of it. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteZip(const std::string& path, const std::vector<ZipEntry>& entries);

}  // namespace carillon::interchange
