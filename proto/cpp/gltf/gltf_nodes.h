// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "proto/cpp/gltf/gltf_document.h"

namespace carillon {

using GltfPoint = std::array<double, 3>;

/// A matrix of 4 by 4, column after column.
using GltfMatrix = std::array<double, 16>;

GltfMatrix Product(const GltfMatrix& a, const GltfMatrix& b);

/// Returns the point `p` moved by the matrix `m`.
GltfPoint Moved(const GltfMatrix& m, const GltfPoint& p);

/// Returns whether the matrix turns a surface inside out.
bool IsMirroring(const GltfMatrix& m);

/// Returns translation * rotation * scale. The rotation is a quaternion (x, y, z, w), whose length
/// does not matter.
GltfMatrix MatrixOf(const std::array<double, 3>& translation, const std::array<double, 4>& rotation,
                    const std::array<double, 3>& scale);

/// The transformation of a node: its matrix, or its translation, rotation and scale.
GltfMatrix MatrixOf(const nlohmann::json& node);

/// The tree of a document's nodes.
class GltfNodes {
 public:
  /// Throws a fault if a node is its own ancestor or a child of two nodes.
  explicit GltfNodes(const GltfDocument& document);

  size_t count() const { return parents_.size(); }
  std::optional<size_t> parent(size_t node) const { return parents_[node]; }

  /// The transformation of each node as the file gives it.
  const std::vector<GltfMatrix>& locals() const { return locals_; }

  /// Returns the matrix from each node's frame to that of the scene, where the nodes have the
  /// transformations `locals`.
  std::vector<GltfMatrix> Worlds(const std::vector<GltfMatrix>& locals) const;

  /// Returns the nodes of the scene that the file shows, or of all where it has no scene.
  std::vector<size_t> Shown(const GltfDocument& document) const;

 private:
  std::vector<std::optional<size_t>> parents_;
  std::vector<size_t> order_;  ///< each node after its parent
  std::vector<GltfMatrix> locals_;
};

}  // namespace carillon
