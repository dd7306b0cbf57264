// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/gltf_extension.h"
#include "client_sdk/interchange/gltf_model.h"
#include "client_sdk/interchange/gltf_writer.h"
#include "client_sdk/interchange/header_json.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr double kHighestHeardHz = 20000;

/// A mode with the frequency and the decay rate that the material gives it.
struct SoundingMode {
  size_t column = 0;
  double frequency_hz = 0;  ///< damped
  double decay_per_s = 0;
  double loudness = 0;  ///< after a blow anywhere, up to a constant
};

/// The norm of each mode's shape over all vertices.
std::vector<double> ShapeNorms(const StoredModel& model) {
  std::vector<double> squares(model.mode_count(), 0.0);
  for (size_t i = 0; i < model.shapes.size(); ++i) {
    squares[i % squares.size()] += double{model.shapes[i]} * model.shapes[i];
  }
  for (double& square : squares) square = std::sqrt(square);
  return squares;
}

/// Orders modes by audibility, as the draft demands for programs that render only some of them.
bool Precedes(const SoundingMode& a, const SoundingMode& b) {
  const bool a_heard = a.frequency_hz <= kHighestHeardHz;
  const bool b_heard = b.frequency_hz <= kHighestHeardHz;
  return a_heard != b_heard ? a_heard : a.loudness > b.loudness;
}

std::vector<SoundingMode> SoundingModes(const StoredModel& model, const v1::Material& material) {
  const std::vector<double> norms = ShapeNorms(model);
  std::vector<SoundingMode> modes;
  for (size_t m = 0; m < model.mode_count(); ++m) {
    const double omega2 = model.eigenvalues[m] * material.young_pa() / material.density_kg_per_m3();
    const double decay = DecayRatePerS(material, std::sqrt(omega2) / (2 * std::numbers::pi));
    if (decay * decay >= omega2) continue;
    modes.push_back({.column = m,
                     .frequency_hz = std::sqrt(omega2 - decay * decay) / (2 * std::numbers::pi),
                     .decay_per_s = decay,
                     .loudness = model.couplings[m] * norms[m] / std::sqrt(omega2)});
  }
  std::ranges::stable_sort(modes, Precedes);
  return modes;
}

/// Returns the shapes for this density, mode by mode, with one vector for each vertex.
std::vector<float> Shapes(const StoredModel& model, const std::vector<SoundingMode>& modes,
                          double density_kg_per_m3) {
  const double scale = 1 / std::sqrt(density_kg_per_m3);
  const size_t row = 3 * model.vertex_count();
  std::vector<float> shapes(modes.size() * row);
  for (size_t i = 0; i < row; ++i) {
    const float* const from = &model.shapes[i * model.mode_count()];
    for (size_t m = 0; m < modes.size(); ++m) {
      shapes[m * row + i] = static_cast<float>(from[modes[m].column] * scale);
    }
  }
  return shapes;
}

std::vector<float> Each(const std::vector<SoundingMode>& modes, double SoundingMode::*figure) {
  std::vector<float> figures;
  figures.reserve(modes.size());
  for (const SoundingMode& mode : modes) figures.push_back(static_cast<float>(mode.*figure));
  return figures;
}

/// Returns the header for the modes that are written, ordered by frequency.
v1::ModalModelHeader HeaderOf(const StoredModel& model, const std::vector<SoundingMode>& modes) {
  v1::ModalModelHeader header = model.header;
  header.set_mode_count(static_cast<uint32_t>(modes.size()));
  const size_t missing = model.mode_count() - modes.size();
  if (missing == 0) return header;
  header.add_warnings(
      absl::StrCat("an export to glTF left out ", missing, " modes that its material overdamps"));
  header.clear_estimated_errors();
  header.clear_poisson_slopes();
  std::vector<bool> kept(model.mode_count(), false);
  for (const SoundingMode& mode : modes) kept[mode.column] = true;
  const auto first = std::ranges::find(kept, false) - kept.begin();
  header.set_complete_to_eigenvalue(
      std::nextafter(model.eigenvalues[static_cast<size_t>(first)], 0));
  return header;
}

json MaterialOf(const v1::Material& material, const std::string& name) {
  json result = {{"density", material.density_kg_per_m3()},
                 {"youngsModulus", material.young_pa()},
                 {"poissonRatio", material.poisson_ratio()}};
  // Two figures cannot express a loss factor; then the file has the decay rates only.
  if (material.loss_factor_size() == 0) {
    result["alpha"] = material.alpha2_per_s();
    result["beta"] = material.alpha1_s();
  }
  if (!name.empty()) result["name"] = name;
  return result;
}

json ModelOf(const StoredModel& model, const std::vector<SoundingMode>& modes,
             double density_kg_per_m3, GltfWriter& arrays) {
  json result = {{"frequencies", arrays.Add(Each(modes, &SoundingMode::frequency_hz), "SCALAR")},
                 {"decayRates", arrays.Add(Each(modes, &SoundingMode::decay_per_s), "SCALAR")},
                 {"positions", arrays.Add(model.vertices, "VEC3")},
                 {"shapes", arrays.Add(Shapes(model, modes, density_kg_per_m3), "VEC3")},
                 {"indices", arrays.Add(model.triangles)},
                 {"material", 0}};
  result["extras"]["carillon"] = {{"header", json::parse(ToJson(HeaderOf(model, modes)))},
                                  {"givenTriangle", arrays.Add(model.given_triangle)}};
  return result;
}

json MeshOf(const StoredModel& model, GltfWriter& arrays) {
  using enum GltfWriter::Target;
  const size_t positions = arrays.Add(model.given_vertices, "VEC3", kVertices);
  json primitive = {{"attributes", {{"POSITION", positions}}},
                    {"indices", arrays.Add(model.given_triangles, kIndices)}};
  return {{"primitives", json::array({std::move(primitive)})}};
}

absl::Status CheckPoissonRatio(const StoredModel& model, const v1::Material& material) {
  const double ours = model.header.settings().poisson_ratio();
  if (std::abs(ours - material.poisson_ratio()) <= kPoissonTolerance) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "POISSON_RATIO_DIFFERS",
                 absl::StrCat("the model was computed for a Poisson's ratio of ", ours,
                              ", the material has ", material.poisson_ratio(),
                              "; compute a model for that material, or name another"));
}

}  // namespace

absl::Status WriteGltfModel(const std::string& path, const StoredModel& model,
                            const v1::Material& material, const GltfNames& names, bool binary) {
  RETURN_IF_ERROR(CheckPoissonRatio(model, material));
  const std::vector<SoundingMode> modes = SoundingModes(model, material);
  if (modes.empty()) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
                   "the material overdamps every mode; name one with less damping");
  }
  GltfWriter arrays;
  json extension = {
      {"acousticMaterials", json::array({MaterialOf(material, names.material)})},
      {"modalModels", json::array({ModelOf(model, modes, material.density_kg_per_m3(), arrays)})}};
  json mesh = MeshOf(model, arrays);
  json node = {{"mesh", 0}, {"extensions", {{kExtension, {{"modalModel", 0}}}}}};
  if (!names.body.empty()) {
    for (json* named : {&extension["modalModels"][0], &mesh, &node}) (*named)["name"] = names.body;
  }
  json asset = {{"asset", {{"version", "2.0"}, {"generator", "Carillon"}}},
                {"extensionsUsed", json::array({kExtension})},
                {"extensions", {{kExtension, std::move(extension)}}},
                {"scene", 0},
                {"scenes", json::array({{{"nodes", json::array({0})}}})},
                {"nodes", json::array({std::move(node)})},
                {"meshes", json::array({std::move(mesh)})}};
  return arrays.Write(path, std::move(asset), binary);
}

}  // namespace carillon::interchange
