// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon::interchange {

/// Reads a glTF 2.0 asset, text or binary. A buffer is read when it is first asked for, so that
/// textures are never read. One thread at a time may use a document.
class GltfDocument {
 public:
  /// Errors: NotFound (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED).
  static absl::StatusOr<GltfDocument> Read(const std::string& path);

  const nlohmann::json& root() const { return root_; }

  /// Returns the bytes of the buffer `index`, from the binary file, a data URI, or a file in the
  /// folder of the asset or below it. The bytes are valid as long as the document exists. Errors:
  /// those of Read().
  absl::StatusOr<std::string_view> Buffer(uint64_t index);

 private:
  absl::StatusOr<std::string> ReadBuffer(uint64_t index) const;

  std::string folder_;
  nlohmann::json root_;
  std::optional<std::string> binary_;  ///< the binary chunk
  std::map<uint64_t, std::string> buffers_;
};

/// Writes an asset with one buffer, and adds the description of the buffer to the asset. The result
/// is one binary file, or a text with the buffer in a data URI. The file gets the name `path` when
/// it is complete. Errors: Internal (OUTPUT_NOT_WRITABLE), ResourceExhausted (MODEL_FILE_TOO_LARGE:
/// a binary file over 4 GiB).
absl::Status WriteGltf(const std::string& path, nlohmann::json asset, std::string_view buffer,
                       bool binary);

/// Returns the member `key` of `object`, or a null if there is none or `object` is no object.
const nlohmann::json& Member(const nlohmann::json& object, const char* key);

/// Returns `value` if it is a whole number that is not negative, otherwise nullopt.
std::optional<uint64_t> Whole(const nlohmann::json& value);

/// Returns `value` if it is a finite number, otherwise nullopt.
std::optional<double> Number(const nlohmann::json& value);

/// Returns `value` if it is a text, otherwise an empty text.
std::string Text(const nlohmann::json& value);

}  // namespace carillon::interchange
