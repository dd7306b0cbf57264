// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/gltf/gltf_nodes.h"

#include "absl/strings/str_cat.h"

namespace carillon {

namespace {
using Json = nlohmann::json;
}  // namespace

GltfMatrix Product(const GltfMatrix& a, const GltfMatrix& b) {
  GltfMatrix product{};
  for (size_t i = 0; i < 16; ++i) {
    for (size_t k = 0; k < 4; ++k) product[i] += a[i % 4 + 4 * k] * b[i / 4 * 4 + k];
  }
  return product;
}

GltfPoint Moved(const GltfMatrix& m, const GltfPoint& p) {
  GltfPoint moved;
  for (size_t x = 0; x < 3; ++x)
    moved[x] = m[x] * p[0] + m[4 + x] * p[1] + m[8 + x] * p[2] + m[12 + x];
  return moved;
}

bool IsMirroring(const GltfMatrix& m) {
  return m[0] * (m[5] * m[10] - m[9] * m[6]) - m[4] * (m[1] * m[10] - m[9] * m[2]) +
             m[8] * (m[1] * m[6] - m[5] * m[2]) <
         0;
}

GltfMatrix MatrixOf(const std::array<double, 3>& translation, const std::array<double, 4>& rotation,
                    const std::array<double, 3>& scale) {
  const auto& [x, y, z, w] = rotation;
  const double square = x * x + y * y + z * z + w * w;
  const double two = square > 0 ? 2 / square : 0;
  return {scale[0] * (1 - two * (y * y + z * z)),
          scale[0] * two * (x * y + z * w),
          scale[0] * two * (x * z - y * w),
          0,
          scale[1] * two * (x * y - z * w),
          scale[1] * (1 - two * (x * x + z * z)),
          scale[1] * two * (y * z + x * w),
          0,
          scale[2] * two * (x * z + y * w),
          scale[2] * two * (y * z - x * w),
          scale[2] * (1 - two * (x * x + y * y)),
          0,
          translation[0],
          translation[1],
          translation[2],
          1};
}

GltfMatrix MatrixOf(const Json& node) {
  if (node.contains("matrix")) return node.at("matrix").get<GltfMatrix>();
  return MatrixOf(node.value("translation", std::array<double, 3>{0, 0, 0}),
                  node.value("rotation", std::array<double, 4>{0, 0, 0, 1}),
                  node.value("scale", std::array<double, 3>{1, 1, 1}));
}

GltfNodes::GltfNodes(const GltfDocument& document) {
  const Json nodes = document.root().value("nodes", Json::array());
  parents_.resize(nodes.size());
  std::vector<std::vector<size_t>> children(nodes.size());
  for (size_t n = 0; n < nodes.size(); ++n) {
    locals_.push_back(MatrixOf(nodes[n]));
    for (const Json& child : nodes[n].value("children", Json::array())) {
      const size_t index = document.IndexIn("nodes", child);
      if (parents_[index]) {
        throw GltfFault(absl::StrCat("node ", index, " is a child of two nodes"));
      }
      parents_[index] = n;
      children[n].push_back(index);
    }
  }
  for (size_t n = 0; n < nodes.size(); ++n) {
    if (!parents_[n]) order_.push_back(n);
  }
  for (size_t at = 0; at < order_.size(); ++at) {
    const std::vector<size_t>& below = children[order_[at]];
    order_.insert(order_.end(), below.begin(), below.end());
  }
  if (order_.size() < nodes.size()) throw GltfFault("a node is its own ancestor");
}

std::vector<GltfMatrix> GltfNodes::Worlds(const std::vector<GltfMatrix>& locals) const {
  std::vector<GltfMatrix> worlds = locals;
  for (const size_t node : order_) {
    if (parents_[node]) worlds[node] = Product(worlds[*parents_[node]], locals[node]);
  }
  return worlds;
}

std::vector<size_t> GltfNodes::Shown(const GltfDocument& document) const {
  if (document.root().value("scenes", Json::array()).empty()) return order_;
  std::vector<bool> is_shown(count());
  const Json& scene = document.At("scenes", document.root().value("scene", Json(0U)));
  for (const Json& root : scene.value("nodes", Json::array())) {
    is_shown[document.IndexIn("nodes", root)] = true;
  }
  std::vector<size_t> shown;
  for (const size_t node : order_) {
    if (parents_[node] && is_shown[*parents_[node]]) is_shown[node] = true;
    if (is_shown[node]) shown.push_back(node);
  }
  return shown;
}

}  // namespace carillon
