// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/interchange/gltf_document.h"

namespace carillon::interchange {

/// One modal model of a glTF, and how large the body is that it describes.
struct ChosenModel {
  const nlohmann::json* model = nullptr;
  /// Metres in a unit of its positions: the scale of the nodes that sound with it.
  double metres_per_unit = 1;
  std::optional<uint64_t> mesh;  ///< of such a node
};

/// Chooses by `pick`, as ReadGltfModel does. Errors: InvalidArgument (MODEL_FILE_INCOMPLETE: there
/// is none; MODEL_FILE_AMBIGUOUS: there are several, or its nodes differ in scale;
/// MODEL_FILE_MALFORMED).
absl::StatusOr<ChosenModel> ChooseModel(const GltfDocument& file, const std::string& pick);

}  // namespace carillon::interchange
