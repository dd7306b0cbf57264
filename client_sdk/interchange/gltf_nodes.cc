// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client_sdk/interchange/file_refusal.h"
#include "client_sdk/interchange/gltf_extension.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr double kScaleTolerance = 1e-4;

using Matrix = std::array<std::array<double, 3>, 3>;  // of columns

struct SoundingNode {
  uint64_t index = 0;
  uint64_t model = 0;
};

/// Returns a list of the glTF, which is empty if the file has none.
const json& List(const json& object, const char* key) {
  static const json empty = json::array();
  const json& list = Member(object, key);
  return list.is_array() ? list : empty;
}

absl::Status Ambiguous(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODEL_FILE_AMBIGUOUS",
                 absl::StrCat(what, ": choose one with --pick"));
}

std::vector<SoundingNode> SoundingNodes(const json& nodes) {
  std::vector<SoundingNode> found;
  for (uint64_t i = 0; i < nodes.size(); ++i) {
    const json& ours = Member(Member(nodes[i], "extensions"), kExtension);
    const auto model = Whole(Member(ours, "modalModel"));
    if (model) found.push_back({i, *model});
  }
  return found;
}

/// Returns the number of the model that `pick` means. If `pick` is the name of a node, only that
/// node remains.
absl::StatusOr<uint64_t> Pick(const json& models, const json& nodes, const std::string& pick,
                              std::vector<SoundingNode>& sounding) {
  if (pick.empty() && models.size() == 1) return 0;
  std::vector<uint64_t> found;
  std::vector<std::string> names;
  for (uint64_t i = 0; i < models.size(); ++i) {
    const std::string name = Text(Member(models[i], "name"));
    names.push_back(absl::StrCat(i, name.empty() ? "" : ": ", name));
    if (!pick.empty() && name == pick) found.push_back(i);
  }
  uint64_t number = 0;
  if (found.empty() && absl::SimpleAtoi(pick, &number) && number < models.size()) return number;
  if (found.size() == 1) return found[0];
  std::vector<SoundingNode> named;
  std::ranges::copy_if(sounding, std::back_inserter(named), [&](const SoundingNode& node) {
    return !pick.empty() && Text(Member(nodes[node.index], "name")) == pick;
  });
  if (named.size() == 1) {
    sounding = named;
    return named[0].model;
  }
  return Ambiguous(absl::StrCat(
      "of the modal models (", absl::StrJoin(names, ", "), ") ",
      pick.empty() ? "none was chosen" : absl::StrCat("'", pick, "' is not exactly one")));
}

std::optional<std::vector<double>> Numbers(const json& list, size_t count) {
  std::vector<double> numbers;
  for (const json& item : list) {
    const auto number = Number(item);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  if (!list.is_array() || numbers.size() != count) return std::nullopt;
  return numbers;
}

/// Returns the rotation matrix of a quaternion (x, y, z, w), multiplied by its squared length.
Matrix Turn(const std::vector<double>& q) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {{{w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)},
           {2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)},
           {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z}}};
}

/// The linear part of a node's own transform.
std::optional<Matrix> Linear(const json& node) {
  const json& whole = Member(node, "matrix");
  if (!whole.is_null()) {
    const auto m = Numbers(whole, 16);
    if (!m) return std::nullopt;
    return Matrix{
        {{(*m)[0], (*m)[1], (*m)[2]}, {(*m)[4], (*m)[5], (*m)[6]}, {(*m)[8], (*m)[9], (*m)[10]}}};
  }
  const json& rotation = Member(node, "rotation");
  const json& scale = Member(node, "scale");
  const auto turned = rotation.is_null() ? std::vector<double>{0, 0, 0, 1} : Numbers(rotation, 4);
  const auto scaled = scale.is_null() ? std::vector<double>{1, 1, 1} : Numbers(scale, 3);
  if (!turned || !scaled) return std::nullopt;
  Matrix result = Turn(*turned);
  for (size_t column = 0; column < 3; ++column) {
    for (double& entry : result[column]) entry *= (*scaled)[column];
  }
  return result;
}

Matrix Product(const Matrix& a, const Matrix& b) {
  Matrix product = {};
  for (size_t column = 0; column < 3; ++column) {
    for (size_t row = 0; row < 3; ++row) {
      for (size_t k = 0; k < 3; ++k) product[column][row] += a[k][row] * b[column][k];
    }
  }
  return product;
}

/// Returns the factor by which a matrix scales all directions, or nullopt if directions differ.
std::optional<double> UniformScale(const Matrix& matrix) {
  const auto dot = [&](size_t a, size_t b) {
    return matrix[a][0] * matrix[b][0] + matrix[a][1] * matrix[b][1] + matrix[a][2] * matrix[b][2];
  };
  const double square = (dot(0, 0) + dot(1, 1) + dot(2, 2)) / 3;
  for (size_t a = 0; a < 3; ++a) {
    for (size_t b = 0; b < 3; ++b) {
      if (!(std::abs(dot(a, b) - (a == b ? square : 0)) <= kScaleTolerance * square))
        return std::nullopt;
    }
  }
  if (!(square > 0) || !std::isfinite(square)) return std::nullopt;
  return std::sqrt(square);
}

/// Returns the parent of each node; for a node without one, the number of nodes.
std::vector<uint64_t> Parents(const json& nodes) {
  std::vector<uint64_t> parents(nodes.size(), nodes.size());
  for (uint64_t i = 0; i < nodes.size(); ++i) {
    for (const json& child : List(nodes[i], "children")) {
      const auto index = Whole(child);
      if (index && *index < nodes.size()) parents[*index] = i;
    }
  }
  return parents;
}

absl::StatusOr<double> GlobalScale(const json& nodes, const std::vector<uint64_t>& parents,
                                   uint64_t index) {
  Matrix matrix = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  uint64_t node = index;
  for (uint64_t depth = 0; node < nodes.size() && depth <= nodes.size(); ++depth) {
    const auto own = Linear(nodes[node]);
    if (!own || depth == nodes.size()) {
      return Malformed(
          absl::StrCat("the transform of node ", node, " is none, or it is its own parent"));
    }
    matrix = Product(*own, matrix);
    node = parents[node];
  }
  const auto scale = UniformScale(matrix);
  if (scale) return *scale;
  return Malformed(absl::StrCat("node ", index,
                                " is scaled unevenly, so that its modes are not known "
                                "(bake the scale into the geometry)"));
}

}  // namespace

absl::StatusOr<ChosenModel> ChooseModel(const GltfDocument& file, const std::string& pick) {
  const json& models = List(Member(Member(file.root(), "extensions"), kExtension), "modalModels");
  if (models.empty()) {
    return Incomplete("the glTF file holds no modal model",
                      absl::StrCat("it needs the extension ", kExtension,
                                   " with modalModels; a mesh alone is "
                                   "computed by `carillon model create`"));
  }
  const json& nodes = List(file.root(), "nodes");
  std::vector<SoundingNode> sounding = SoundingNodes(nodes);
  ASSIGN_OR_RETURN(const uint64_t number, Pick(models, nodes, pick, sounding));
  if (number >= models.size()) return Malformed(absl::StrCat("there is no modal model ", number));
  ChosenModel chosen{.model = &models[number], .metres_per_unit = 1, .mesh = std::nullopt};
  const std::vector<uint64_t> parents = Parents(nodes);
  bool first = true;
  for (const auto& [index, model] : sounding) {
    if (model != number) continue;
    ASSIGN_OR_RETURN(const double scale, GlobalScale(nodes, parents, index));
    if (!first && std::abs(scale / chosen.metres_per_unit - 1) > kScaleTolerance) {
      return Ambiguous(
          "nodes of different scale sound with the modal model, so that its size is not known");
    }
    if (first) chosen.metres_per_unit = scale;
    if (!chosen.mesh) chosen.mesh = Whole(Member(nodes[index], "mesh"));
    first = false;
  }
  return chosen;
}

}  // namespace carillon::interchange
