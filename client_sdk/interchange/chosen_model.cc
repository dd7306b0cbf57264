// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/chosen_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client_sdk/interchange/file_refusal.h"
#include "client_sdk/interchange/gltf_extension.h"
#include "client_sdk/interchange/gltf_json.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf/gltf_nodes.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr double kScaleTolerance = 1e-4;

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

/// Returns the factor by which a matrix scales all directions, or nullopt if directions differ.
std::optional<double> UniformScale(const GltfMatrix& m) {
  const auto dot = [&](size_t a, size_t b) {
    return m[4 * a] * m[4 * b] + m[4 * a + 1] * m[4 * b + 1] + m[4 * a + 2] * m[4 * b + 2];
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
  const GltfNodes tree(file);
  const std::vector<GltfMatrix> worlds = tree.Worlds(tree.locals());
  bool first = true;
  for (const auto& [index, model] : sounding) {
    if (model != number) continue;
    const std::optional<double> scale = UniformScale(worlds[index]);
    if (!scale) {
      return Malformed(absl::StrCat("node ", index,
                                    " is scaled unevenly, so that its modes are not known "
                                    "(bake the scale into the geometry)"));
    }
    if (!first && std::abs(*scale / chosen.metres_per_unit - 1) > kScaleTolerance) {
      return Ambiguous(
          "nodes of different scale sound with the modal model, so that its size is not known");
    }
    if (first) chosen.metres_per_unit = *scale;
    if (!chosen.mesh) chosen.mesh = Whole(Member(nodes[index], "mesh"));
    first = false;
  }
  return chosen;
}

}  // namespace carillon::interchange
