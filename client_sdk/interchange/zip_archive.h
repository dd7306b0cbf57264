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

/// Reads a zip file. One thread at a time may use a reader.
class ZipReader {
 public:
  /// Errors: NotFound (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED).
  static absl::StatusOr<ZipReader> Open(const std::string& path);
  ZipReader(ZipReader&&) noexcept;
  ZipReader& operator=(ZipReader&&) noexcept;
  ~ZipReader();

  /// Returns the file `name` of the archive, or nullopt if there is none. Errors: InvalidArgument
  /// (MODEL_FILE_MALFORMED: the file is damaged), ResourceExhausted (MODAL_MODEL_TOO_LARGE: the
  /// file is larger than 4 GiB).
  absl::StatusOr<std::optional<std::string>> Read(const std::string& name) const;

 private:
  struct State;
  explicit ZipReader(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

/// A file to be written into a zip file. Its content is `head` followed by `body`.
struct ZipEntry {
  std::string name;
  std::string head;
  std::string_view body;
};

/// Writes a zip file without compression. The file gets the name `path` when it is complete.
/// Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteZip(const std::string& path, const std::vector<ZipEntry>& entries);

}  // namespace carillon::interchange
