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

/// A glTF 2.0 asset that is read, text or binary. Buffers are read when first asked for, so that
/// textures never are. One thread at a time.
class GltfDocument {
 public:
  /// Errors: NotFound (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED).
  static absl::StatusOr<GltfDocument> Read(const std::string& path);

  const nlohmann::json& root() const { return root_; }

  /// The bytes of buffer `index`: of the binary file, of a data URI, or of a file in the same
  /// folder or below. Valid as long as the document. Errors: as Read.
  absl::StatusOr<std::string_view> Buffer(uint64_t index);

 private:
  absl::StatusOr<std::string> ReadBuffer(uint64_t index) const;

  std::string folder_;
  nlohmann::json root_;
  std::optional<std::string> binary_;  ///< the binary chunk
  std::map<uint64_t, std::string> buffers_;
};

/// Writes an asset of one buffer, whose description is added: as one binary file, or as text with
/// the buffer in a data URI. Under another name first, so that `path` never holds half of it.
/// Errors: Internal (OUTPUT_NOT_WRITABLE), ResourceExhausted (MODEL_FILE_TOO_LARGE: a binary file
/// over 4 GiB).
absl::Status WriteGltf(const std::string& path, nlohmann::json asset, std::string_view buffer,
                       bool binary);

/// The member of an object; a null where there is none, or no object.
const nlohmann::json& Member(const nlohmann::json& object, const char* key);

/// A whole number that is not negative, or nullopt.
std::optional<uint64_t> Whole(const nlohmann::json& value);

/// A finite number, or nullopt.
std::optional<double> Number(const nlohmann::json& value);

/// A text, or an empty one.
std::string Text(const nlohmann::json& value);

}  // namespace carillon::interchange
