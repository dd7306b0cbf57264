// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "proto/cpp/gltf/gltf_document.h"

namespace carillon::interchange {

/// A modal model of a glTF, and the scale of the body that it describes.
struct ChosenModel {
  const nlohmann::json* model = nullptr;
  /// The number of metres in a unit of its positions, from the scale of the nodes that sound with
  /// the model.
  double metres_per_unit = 1;
  std::optional<uint64_t> mesh;  ///< the mesh of such a node
};

/// Chooses a model by the `pick` of ReadGltfModel. Errors: InvalidArgument (MODEL_FILE_MALFORMED:
/// there is no such model; MODEL_FILE_AMBIGUOUS: there are several, or the nodes of the model
/// differ in scale; MODEL_FILE_MALFORMED). Throws a GltfFault if the tree of nodes is damaged.
absl::StatusOr<ChosenModel> ChooseModel(const GltfDocument& file, const std::string& pick);

}  // namespace carillon::interchange
