// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// A fault of a glTF. The functions of this folder throw it, as the JSON library throws its own,
/// which is a nlohmann::json::exception. Whoever begins to read a document catches both.
class GltfFault : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Returns InvalidArgument with `reason` and the text of the fault, whether ours or the library's.
absl::Status GltfRefusal(absl::string_view reason, const std::exception& fault);

/// A glTF 2.0 asset, text or binary, with its buffers. A buffer is read when it is first asked for,
/// so that textures are never read. One thread at a time may use a document.
/// https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
class GltfDocument {
 public:
  /// Parses an asset. `bytes` must outlive the document. The files of its buffers are in `folder`
  /// or below it; without a folder all data must be in the asset. JSON nested deeper than 64 is
  /// left out, so that recursive functions do not exhaust the stack. Throws a fault if the asset is
  /// cut short or not of version 2.
  explicit GltfDocument(std::string_view bytes, std::optional<std::string> folder = std::nullopt);

  const nlohmann::json& root() const { return root_; }

  /// Throws a fault if the asset requires an extension that would change its surfaces and is not
  /// read.
  void CheckExtensions() const;

  /// Returns `index` as a number if the array of that name has such an element; otherwise throws a
  /// fault.
  size_t IndexIn(const char* array, const nlohmann::json& index) const;

  /// Returns the element `index` of an array of the document, or throws a fault.
  const nlohmann::json& At(const char* array, const nlohmann::json& index) const;

  /// Returns the numbers of an accessor, one element after the other, with the changes of a sparse
  /// accessor. `type` is the type that it must have, such as "VEC3". Normalized numbers are between
  /// -1 and 1. `Number` is float or double.
  template <typename Number>
  std::vector<Number> Read(const nlohmann::json& accessor_index, absl::string_view type) const;

  /// Returns the whole numbers of an accessor, all below `limit`.
  std::vector<uint32_t> ReadIndices(const nlohmann::json& accessor_index, size_t limit) const;

 private:
  std::string_view Buffer(size_t index) const;
  std::string FileOfBuffer(size_t index, const std::string& uri) const;
  /// The bytes of a buffer view from `offset` on.
  std::string_view ViewBytes(const nlohmann::json& view_index, size_t offset) const;
  template <typename Number>
  void ApplySparse(const nlohmann::json& accessor, size_t width,
                   std::vector<Number>& numbers) const;

  nlohmann::json root_;
  std::string_view binary_;  ///< the second chunk of a binary asset
  std::optional<std::string> folder_;
  mutable std::map<size_t, std::string> buffers_;  ///< those that were decoded or read
};

/// Returns the bytes of a file, or nothing if it cannot be read.
std::optional<std::string> BytesOfFile(const std::string& path);

}  // namespace carillon
