// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/interchange/gltf_document.h"

namespace carillon::interchange {

/// Reads the floats of the accessor with the index `property`. An accessor of the type "VEC3" has
/// three numbers for each element. Error messages call it `name`. Errors: InvalidArgument
/// (MODEL_FILE_MALFORMED), and those of GltfDocument::Buffer.
absl::StatusOr<std::vector<float>> ReadFloats(GltfDocument& file, const nlohmann::json& property,
                                              const std::string& name, const std::string& type);

/// Reads the unsigned integers, of 8, 16 or 32 bits, of the accessor with the index `property`.
/// Errors: those of ReadFloats.
absl::StatusOr<std::vector<uint32_t>> ReadIndices(GltfDocument& file,
                                                  const nlohmann::json& property,
                                                  const std::string& name);

/// Collects arrays in one buffer, and describes them by accessors and buffer views.
class AccessorWriter {
 public:
  /// The purpose of a buffer view, as glTF numbers it.
  enum class Target { kNone = 0, kVertices = 34962, kIndices = 34963 };

  /// Adds floats of the type "SCALAR" or "VEC3", and returns the index of the accessor. For
  /// vertices the accessor states the least and the greatest value of each component, which glTF
  /// demands.
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
