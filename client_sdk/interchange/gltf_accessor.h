// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/interchange/gltf_document.h"

namespace carillon::interchange {

/// The numbers of the accessor whose index `property` is; `name` is for errors. "VEC3" gives three
/// a piece. Errors: InvalidArgument (MODEL_FILE_MALFORMED), and those of GltfDocument::Buffer.
absl::StatusOr<std::vector<float>> ReadFloats(GltfDocument& file, const nlohmann::json& property,
                                              const std::string& name, const std::string& type);

/// Likewise of whole numbers of 8, 16 or 32 bits.
absl::StatusOr<std::vector<uint32_t>> ReadIndices(GltfDocument& file,
                                                  const nlohmann::json& property,
                                                  const std::string& name);

/// Collects arrays in one buffer, with their accessors and buffer views.
class AccessorWriter {
 public:
  /// What a buffer view is for, by glTF's numbers.
  enum class Target { kNone = 0, kVertices = 34962, kIndices = 34963 };

  /// Adds "SCALAR" or "VEC3" floats; with the least and the greatest of each component where they
  /// are vertices, as glTF demands. Returns the index of the accessor.
  size_t Add(const std::vector<float>& numbers, const std::string& type,
             Target target = Target::kNone);
  size_t Add(const std::vector<uint32_t>& numbers, Target target = Target::kNone);

  const nlohmann::json& accessors() const { return accessors_; }
  const nlohmann::json& views() const { return views_; }
  const std::string& bytes() const { return bytes_; }

 private:
  size_t AddView(const void* data, size_t byte_count, Target target);

  std::string bytes_;
  nlohmann::json accessors_ = nlohmann::json::array();
  nlohmann::json views_ = nlohmann::json::array();
};

}  // namespace carillon::interchange
