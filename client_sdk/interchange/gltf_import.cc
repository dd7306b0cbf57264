// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/interchange/chosen_model.h"
#include "client_sdk/interchange/complete_model.h"
#include "client_sdk/interchange/damping.h"
#include "client_sdk/interchange/file_refusal.h"
#include "client_sdk/interchange/gltf_extension.h"
#include "client_sdk/interchange/gltf_json.h"
#include "client_sdk/interchange/gltf_model.h"
#include "client_sdk/interchange/gltf_surface.h"
#include "client_sdk/interchange/header_json.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf/gltf_document.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/status_macros.h"
#include "proto/cpp/utf8.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr double kOmegaPerHz = 2 * std::numbers::pi;

/// The arrays of a modal model in the order of the file.
struct GltfModes {
  std::vector<float> frequencies_hz;
  std::vector<float> decay_rates_per_s;
  std::vector<float> positions;
  std::vector<float> shapes;  ///< mode by mode, a vector a position
  std::vector<uint32_t> indices;

  size_t mode_count() const { return frequencies_hz.size(); }
  size_t point_count() const { return positions.size() / 3; }
};

bool AllFinite(const std::vector<float>& numbers) {
  return std::ranges::all_of(numbers, [](float x) { return std::isfinite(x); });
}

absl::Status Check(const GltfModes& modes) {
  if (modes.decay_rates_per_s.size() != modes.mode_count()) {
    return Malformed(absl::StrCat("there are ", modes.mode_count(), " frequencies, but ",
                                  modes.decay_rates_per_s.size(), " decay rates"));
  }
  if (modes.mode_count() == 0 || modes.point_count() == 0 || modes.indices.size() % 3 != 0) {
    return Malformed("there is no mode, no position, or a triangle with fewer than three corners");
  }
  // Each count fits in memory, so that their product does not overflow.
  if (modes.shapes.size() / 3 != modes.mode_count() * modes.point_count()) {
    return Malformed(absl::StrCat("there are ", modes.shapes.size() / 3,
                                  " shape vectors, not one for each of ", modes.mode_count(),
                                  " modes and ", modes.point_count(), " positions"));
  }
  if (!AllFinite(modes.frequencies_hz) || !AllFinite(modes.decay_rates_per_s) ||
      !AllFinite(modes.positions) || !AllFinite(modes.shapes)) {
    return Malformed("a frequency, decay rate, position or shape is not finite");
  }
  if (std::ranges::min(modes.frequencies_hz) <= 0 ||
      std::ranges::min(modes.decay_rates_per_s) < 0) {
    return Malformed("a frequency is not above zero, or a decay rate is below");
  }
  return absl::OkStatus();
}

/// Calls `read`, and names the array of the model in its fault.
template <class Read>
auto Named(const char* name, Read read) {
  try {
    return read();
  } catch (const GltfFault& fault) {
    throw GltfFault(absl::StrCat("\"", name, "\": ", fault.what()));
  }
}

absl::StatusOr<GltfModes> ReadModes(const GltfDocument& file, const json& model) {
  const auto read = [&](const char* name, const char* type) {
    return Named(name, [&] { return file.Read<float>(Member(model, name), type); });
  };
  GltfModes modes = {.frequencies_hz = read("frequencies", "SCALAR"),
                     .decay_rates_per_s = read("decayRates", "SCALAR"),
                     .positions = read("positions", "VEC3"),
                     .shapes = read("shapes", "VEC3"),
                     .indices = {}};
  if (const json& indices = Member(model, "indices"); !indices.is_null()) {
    modes.indices =
        Named("indices", [&] { return file.ReadIndices(indices, modes.point_count()); });
  }
  RETURN_IF_ERROR(Check(modes));
  return modes;
}

/// Returns `given` with the figures of the file added where it has none. If neither has a damping,
/// the result has none.
absl::StatusOr<v1::Material> MaterialOf(const GltfDocument& file, const json& model,
                                        const v1::Material& given) {
  const json& materials =
      Member(Member(Member(file.root(), "extensions"), kExtension), "acousticMaterials");
  const auto index = Whole(Member(model, "material"));
  const bool known = index && materials.is_array() && *index < materials.size();
  if (index && !known) return Malformed(absl::StrCat("there is no acoustic material ", *index));
  const json ours = known ? materials[*index] : json();
  v1::Material material = given;
  material.clear_preset();
  const auto fill = [&](const char* key, bool has, auto set) {
    const auto figure = Number(Member(ours, key));
    if (!has && figure) set(*figure);
  };
  fill("density", given.has_density_kg_per_m3(),
       [&](double x) { material.set_density_kg_per_m3(x); });
  fill("youngsModulus", given.has_young_pa(), [&](double x) { material.set_young_pa(x); });
  fill("poissonRatio", given.has_poisson_ratio(), [&](double x) { material.set_poisson_ratio(x); });
  fill("beta", given.has_alpha1_s(), [&](double x) { material.set_alpha1_s(x); });
  fill("alpha", given.has_alpha2_per_s(), [&](double x) { material.set_alpha2_per_s(x); });
  if (!material.has_density_kg_per_m3() || !material.has_young_pa() ||
      !material.has_poisson_ratio()) {
    return Incomplete(
        "the glTF file does not say density, Young's modulus and Poisson's ratio of the "
        "modal model's material",
        "give --material, or --density, --young and --poisson");
  }
  const double density = material.density_kg_per_m3();
  const double young = material.young_pa();
  const double poisson = material.poisson_ratio();
  if (!(density > 0 && young > 0 && std::isfinite(density + young) && poisson > -1 &&
        poisson < 0.5)) {
    return Malformed("density, Young's modulus or Poisson's ratio of the material is impossible");
  }
  return material;
}

std::vector<DampedMode> Damped(const GltfModes& modes) {
  std::vector<DampedMode> damped;
  for (size_t m = 0; m < modes.mode_count(); ++m) {
    const double decay = modes.decay_rates_per_s[m];
    damped.push_back({.natural_hz = std::hypot(modes.frequencies_hz[m], decay / kOmegaPerHz),
                      .decay_per_s = decay});
  }
  return damped;
}

/// Gives the material a damping that fits the decay rates, and adds a warning if there is none.
void SetDamping(const std::vector<DampedMode>& modes, v1::Material& material,
                v1::ModalModelHeader& header) {
  FitDamping(modes, material);
  const double off = DampingError(modes, material);
  if (off <= kSameDamping) return;
  header.add_warnings(
      absl::StrFormat("the decay rates of the file are those of no material: with the nearest, "
                      "some are off by %.0f %%",
                      100 * off));
}

/// Sets the eigenvalues for unit material, ascending, and the shapes with their modes in that
/// order. The shape at a vertex is that at its point in `points`.
void SetModes(const GltfModes& modes, const std::vector<DampedMode>& damped,
              const std::vector<uint32_t>& points, const v1::Material& material,
              StoredModel& model) {
  std::vector<size_t> order(modes.mode_count());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t mode) { return damped[mode].natural_hz; });
  for (const size_t mode : order) {
    const double omega = kOmegaPerHz * damped[mode].natural_hz;
    model.eigenvalues.push_back(omega * omega * material.density_kg_per_m3() / material.young_pa());
  }
  const double scale = std::sqrt(material.density_kg_per_m3());
  model.shapes.reserve(points.size() * 3 * order.size());
  for (const uint32_t point : points) {
    for (size_t axis = 0; axis < 3; ++axis) {
      for (const size_t mode : order) {
        const float shape = modes.shapes[(mode * modes.point_count() + point) * 3 + axis];
        model.shapes.push_back(static_cast<float>(shape * scale));
      }
    }
  }
}

/// Reads the sounding surface: the triangles between the sample points or, without them, the mesh
/// of the node, each vertex of which moves like the nearest sample point, as the draft demands.
/// Returns the sample point of each vertex.
absl::StatusOr<std::vector<uint32_t>> SetSurface(const GltfDocument& file,
                                                 const ChosenModel& chosen, const GltfModes& modes,
                                                 StoredModel& model) {
  std::vector<uint32_t> points(modes.point_count());
  std::iota(points.begin(), points.end(), 0U);
  if (!modes.indices.empty()) {
    model.vertices = modes.positions;
    model.triangles = modes.indices;
  } else {
    if (!chosen.mesh) {
      return Incomplete("the modal model has sample points without triangles, and its node no mesh",
                        "store the triangles as the model's indices");
    }
    ASSIGN_OR_RETURN(MeshSurface mesh, ReadMesh(file, *chosen.mesh));
    if (!AllFinite(mesh.vertices)) return Malformed("a vertex of the mesh is not finite");
    points = NearestPoints(modes.positions, mesh.vertices);
    model.vertices = std::move(mesh.vertices);
    model.triangles = std::move(mesh.triangles);
  }
  for (float& x : model.vertices) x = static_cast<float>(x * chosen.metres_per_unit);
  return points;
}

/// Reads the surface as given if Carillon wrote the file and no program has changed it since;
/// otherwise leaves it out.
void SetGivenSurface(const GltfDocument& file, const ChosenModel& chosen, StoredModel& model) {
  const json& ours = Member(Member(Member(*chosen.model, "extras"), "carillon"), "givenTriangle");
  if (ours.is_null() || !chosen.mesh) return;
  try {
    absl::StatusOr<MeshSurface> mesh = ReadMesh(file, *chosen.mesh);
    if (!mesh.ok() || !AllFinite(mesh->vertices)) return;
    std::vector<uint32_t> lies_on = file.ReadIndices(ours, mesh->triangles.size() / 3);
    if (lies_on.size() != model.triangle_count()) return;
    model.given_triangle = std::move(lies_on);
    model.given_vertices = std::move(mesh->vertices);
    model.given_triangles = std::move(mesh->triangles);
  } catch (const GltfFault&) {
    return;
  } catch (const json::exception&) {
    return;
  }
  for (float& x : model.given_vertices) x = static_cast<float>(x * chosen.metres_per_unit);
}

/// Returns the longest beginning of a name that has at most kMaxLabelBytes and no incomplete
/// character.
std::string ShortText(const json& value) {
  std::string text = Text(value);
  size_t size = std::min(text.size(), kMaxLabelBytes);
  while (size < text.size() && ContinuesCharacter(text[size])) --size;
  text.resize(size);
  return text;
}

/// Returns the header that Carillon wrote if it is still true; otherwise makes one from the file.
v1::ModalModelHeader HeaderOf(const GltfDocument& file, const ChosenModel& chosen,
                              const GltfModes& modes, const v1::Material& material) {
  const json& ours = Member(Member(Member(*chosen.model, "extras"), "carillon"), "header");
  const auto written = ours.is_object() ? HeaderFromJson(ours.dump()) : std::nullopt;
  if (written && written->mode_count() == modes.mode_count() && chosen.metres_per_unit == 1 &&
      std::abs(written->settings().poisson_ratio() - material.poisson_ratio()) <=
          kPoissonTolerance) {
    return *written;
  }
  v1::ModalModelHeader header;
  header.mutable_settings()->set_poisson_ratio(material.poisson_ratio());
  header.mutable_settings()->set_metres_per_unit(chosen.metres_per_unit);
  const std::string generator = ShortText(Member(Member(file.root(), "asset"), "generator"));
  header.set_solver(absl::StrCat("glTF", generator.empty() ? "" : " by ", generator));
  header.add_warnings("read from a glTF file, which does not say whether modes are missing");
  return header;
}

absl::StatusOr<GltfModel> ReadWhole(const std::string& path, const std::string& pick,
                                    const v1::Material& material) {
  const std::optional<std::string> bytes = BytesOfFile(path);
  if (!bytes) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be read; check its name and its permissions"));
  }
  const GltfDocument file(*bytes, std::filesystem::path(path).parent_path());
  ASSIGN_OR_RETURN(const ChosenModel chosen, ChooseModel(file, pick));
  ASSIGN_OR_RETURN(const GltfModes modes, ReadModes(file, *chosen.model));
  ASSIGN_OR_RETURN(v1::Material resolved, MaterialOf(file, *chosen.model, material));
  GltfModel result = {
      .model = {}, .label = ShortText(Member(*chosen.model, "name")), .material = resolved};
  ASSIGN_OR_RETURN(const std::vector<uint32_t> points,
                   SetSurface(file, chosen, modes, result.model));
  SetGivenSurface(file, chosen, result.model);
  result.model.header = HeaderOf(file, chosen, modes, resolved);
  const std::vector<DampedMode> damped = Damped(modes);
  SetDamping(damped, result.material, result.model.header);
  SetModes(modes, damped, points, resolved, result.model);
  RETURN_IF_ERROR(Complete(result.model));
  return result;
}

}  // namespace

absl::StatusOr<GltfModel> ReadGltfModel(const std::string& path, const std::string& pick,
                                        const v1::Material& material) {
  try {
    return ReadWhole(path, pick, material);
  } catch (const std::bad_alloc&) {
    return OutOfMemory(path);
  } catch (const GltfFault& fault) {
    return GltfRefusal("MODEL_FILE_MALFORMED", fault);
  } catch (const json::exception& fault) {
    return GltfRefusal("MODEL_FILE_MALFORMED", fault);
  }
}

}  // namespace carillon::interchange
