// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "proto/cpp/gltf/gltf_document.h"
#include "proto/cpp/gltf/gltf_nodes.h"

namespace carillon {

/// The triangles of a primitive.
struct GltfSurface {
  std::vector<GltfPoint> points;
  std::vector<uint32_t> corners;  ///< three indices into `points` for each triangle
  std::string material;           ///< its name, or its number if it has none; empty: no material
};

/// Returns the triangles of a primitive in the frame of its mesh: those of lists, strips and fans,
/// with the morph targets added, each by its weight. Points and lines have no triangles.
GltfSurface ReadPrimitive(const GltfDocument& document, const nlohmann::json& primitive,
                          const nlohmann::json& weights);

/// Returns the primitives of a node's mesh in the frame of the scene: with the weights of morph
/// targets that the file gives, and with skins as their joints stand. `worlds` are the matrices of
/// all nodes. The outside of a mirrored surface stays outside. Throws a fault if an extension
/// places the mesh several times.
std::vector<GltfSurface> ReadPlacedMesh(const GltfDocument& document, size_t node,
                                        const std::vector<GltfMatrix>& worlds);

}  // namespace carillon
