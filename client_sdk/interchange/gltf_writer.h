// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace carillon::interchange {

/// Writes a glTF 2.0: collects arrays in one buffer, and describes them by accessors and buffer
/// views.
class GltfWriter {
 public:
  /// The purpose of a buffer view, as glTF numbers it.
  enum class Target { kNone = 0, kVertices = 34962, kIndices = 34963 };

  /// Adds floats of the type "SCALAR" or "VEC3", and returns the index of the accessor. For
  /// vertices the accessor states the least and the greatest value of each component, which glTF
  /// demands.
  size_t Add(const std::vector<float>& numbers, const std::string& type,
             Target target = Target::kNone);
  size_t Add(const std::vector<uint32_t>& numbers, Target target = Target::kNone);

  /// Writes an asset with the arrays, and adds their description to the asset. The result is one
  /// binary file, or a text with the arrays in a data URI. The file gets the name `path` when it is
  /// complete. Errors: Internal (OUTPUT_NOT_WRITABLE), ResourceExhausted (MODAL_MODEL_TOO_LARGE: a
  /// binary file over 4 GiB).
  absl::Status Write(const std::string& path, nlohmann::json asset, bool binary) const;

 private:
  size_t AddView(const void* data, size_t byte_count, Target target);

  std::string bytes_;
  nlohmann::json accessors_ = nlohmann::json::array();
  nlohmann::json views_ = nlohmann::json::array();
};

}  // namespace carillon::interchange
