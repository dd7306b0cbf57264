// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/decomposition_request.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/material_catalogue.h"
#include "server/base/sha256.h"
#include "server/decomposition/shortest_decimal.h"

namespace carillon {
namespace {

constexpr std::array kFormats = {"obj", "ply", "stl", "off", "msh", "mesh", "node"};
constexpr size_t kMaxLabelBytes = 200;
constexpr int kMostPriority = 100;
constexpr int kMostFixtures = 16;
constexpr uint32_t kMostKept = 5000;
constexpr double kPoissonSteps = 1e4;  // of one

absl::Status Invalid(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

absl::Status CheckMesh(const v1::CreateModalModelRequest& request) {
  if (std::ranges::find(kFormats, request.mesh_format()) == kFormats.end()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
                   absl::StrCat("mesh_format is \"", request.mesh_format(),
                                "\"; name one of obj, ply, stl, off, msh, mesh, node"));
  }
  if (!IsSha256Hex(request.mesh_digest())) {
    return Refusal(
        absl::StatusCode::kNotFound, "MESH_NOT_FOUND",
        "mesh_digest is not 64 lower-case hexadecimal digits: give what UploadMesh answered");
  }
  return absl::OkStatus();
}

absl::Status CheckSettings(const v1::DecompositionSettings& settings) {
  if (!(settings.poisson_ratio() > -1 && settings.poisson_ratio() < 0.5)) {
    return Invalid(
        absl::StrCat("poisson_ratio is ", settings.poisson_ratio(),
                     " after rounding to 1e-4; it must be greater than -1 and less than 0.5"));
  }
  if (!(std::isfinite(settings.metres_per_unit()) && settings.metres_per_unit() > 0)) {
    return Invalid(absl::StrCat("metres_per_unit is ", settings.metres_per_unit(),
                                "; it must be greater than zero"));
  }
  if (!(std::isfinite(settings.mesh().wall_m()) && settings.mesh().wall_m() >= 0)) {
    return Invalid(
        absl::StrCat("wall_m is ", settings.mesh().wall_m(), "; it must be zero or more"));
  }
  for (const double figure :
       {settings.mesh().accuracy(), settings.mesh().budget_s(), settings.mesh().budget_gib()}) {
    if (std::isfinite(figure) && figure >= 0) continue;
    return Invalid(absl::StrCat("an accuracy or budget is ", figure, "; it must be zero or more"));
  }
  for (const v1::Fixture& fixture : settings.fixtures()) {
    if (const auto text = FixtureText(fixture); !text.ok()) return text.status();
  }
  if (settings.fixtures_size() > kMostFixtures) {
    return Invalid(absl::StrCat("there are ", settings.fixtures_size(), " fixtures; at most ",
                                kMostFixtures, " are taken: hold a group, or a larger box"));
  }
  if (settings.keep_mode_count() > kMostKept) {
    return Invalid(absl::StrCat("keep_mode_count is ", settings.keep_mode_count(),
                                "; it must be at most ", kMostKept));
  }
  if (!v1::Element_IsValid(settings.element()) || !v1::MassMatrix_IsValid(settings.mass_matrix())) {
    return Invalid("element or mass_matrix has a value that this daemon does not know");
  }
  return absl::OkStatus();
}

absl::Status CheckHints(const v1::CreateModalModelRequest& request) {
  if (!(std::isfinite(request.size()) && request.size() > 0)) {
    return Invalid(absl::StrCat("size is ", request.size(), "; it must be greater than zero"));
  }
  if (!(request.min_frequency_hz() > 0 && request.max_frequency_hz() > request.min_frequency_hz() &&
        std::isfinite(request.max_frequency_hz()))) {
    return Invalid(absl::StrCat("the band is ", request.min_frequency_hz(), " to ",
                                request.max_frequency_hz(),
                                " Hz; it must rise from above zero to a finite frequency"));
  }
  if (request.priority() < -kMostPriority || request.priority() > kMostPriority) {
    return Invalid(absl::StrCat("priority is ", request.priority(), "; it must be ", -kMostPriority,
                                " to ", kMostPriority));
  }
  if (!(std::isfinite(request.time_limit_s()) && request.time_limit_s() >= 0)) {
    return Invalid(
        absl::StrCat("time_limit_s is ", request.time_limit_s(), "; it must be zero or more"));
  }
  if (request.label().size() > kMaxLabelBytes) {
    return Invalid(absl::StrCat("label has ", request.label().size(), " bytes; at most ",
                                kMaxLabelBytes, " are kept"));
  }
  return absl::OkStatus();
}

void FillIn(v1::DecompositionSettings& settings, const v1::Material& material) {
  const double poisson =
      settings.poisson_ratio() == 0 ? material.poisson_ratio() : settings.poisson_ratio();
  settings.set_poisson_ratio(std::round(poisson * kPoissonSteps) / kPoissonSteps);
  if (settings.element() == v1::ELEMENT_UNSPECIFIED) settings.set_element(v1::ELEMENT_QUADRATIC);
  if (settings.mass_matrix() == v1::MASS_MATRIX_UNSPECIFIED) {
    settings.set_mass_matrix(v1::MASS_MATRIX_CONSISTENT);
  }
  if (settings.metres_per_unit() == 0) settings.set_metres_per_unit(1);
}

absl::string_view KeepSurface(const v1::MeshSettings& mesh) {
  if (!mesh.has_keep_surface()) return "auto";
  return mesh.keep_surface() ? "yes" : "no";
}

}  // namespace

absl::StatusOr<v1::CreateModalModelRequest> ResolveRequest(
    const v1::CreateModalModelRequest& request) {
  absl::Status status = CheckMesh(request);
  if (!status.ok()) return status;
  const absl::StatusOr<v1::Material> material = ResolveMaterial(request.material());
  if (!material.ok()) return material.status();
  v1::CreateModalModelRequest resolved = request;
  *resolved.mutable_material() = *material;
  FillIn(*resolved.mutable_settings(), *material);
  if (resolved.size() == 0) resolved.set_size(1);
  if (resolved.max_frequency_hz() == 0) resolved.set_max_frequency_hz(20'000);
  if (resolved.min_frequency_hz() == 0) resolved.set_min_frequency_hz(20);
  status = CheckSettings(resolved.settings());
  if (status.ok()) status = CheckHints(resolved);
  if (!status.ok()) return status;
  return resolved;
}

std::string CanonicalText(const v1::CreateModalModelRequest& resolved) {
  const v1::DecompositionSettings& settings = resolved.settings();
  std::string text = absl::StrCat(
      "carillon-decomposition 1\n",             //
      "mesh ", resolved.mesh_digest(), "\n",    //
      "format ", resolved.mesh_format(), "\n",  //
      "poisson_1e-4 ", std::lround(settings.poisson_ratio() * kPoissonSteps), "\n", "element ",
      settings.element() == v1::ELEMENT_LINEAR ? "linear" : "quadratic", "\n", "mass ",
      settings.mass_matrix() == v1::MASS_MATRIX_LUMPED ? "lumped" : "consistent", "\n",
      "metres_per_unit ", ShortestDecimal(settings.metres_per_unit()), "\n", "keep_surface ",
      KeepSurface(settings.mesh()), "\n", "target_node_count ", settings.mesh().target_node_count(),
      "\n");
  // What came later is named only where it is used, so that a model keeps its name.
  const v1::MeshSettings& mesh = settings.mesh();
  if (mesh.repair()) absl::StrAppend(&text, "repair yes\n");
  if (mesh.wall_m() > 0) absl::StrAppend(&text, "wall_m ", ShortestDecimal(mesh.wall_m()), "\n");
  if (mesh.accuracy() > 0) {
    absl::StrAppend(&text, "accuracy ", ShortestDecimal(mesh.accuracy()), "\n");
  }
  if (mesh.budget_s() > 0 || mesh.budget_gib() > 0) {
    absl::StrAppend(&text, "budget ", ShortestDecimal(mesh.budget_s()), " ",
                    ShortestDecimal(mesh.budget_gib()), "\n");
  }
  if (settings.keep_mode_count() > 0) {
    absl::StrAppend(&text, "keep ", settings.keep_mode_count(), "\n");
  }
  std::set<std::string> fixtures;
  for (const v1::Fixture& fixture : settings.fixtures()) {
    fixtures.insert(FixtureText(fixture).value_or(""));
  }
  for (const std::string& fixture : fixtures) absl::StrAppend(&text, "fix ", fixture, "\n");
  return text;
}

std::string RequestDigest(const v1::CreateModalModelRequest& resolved) {
  return Sha256Hex(CanonicalText(resolved));
}

double UnitEigenvalue(const v1::CreateModalModelRequest& resolved, double frequency_hz) {
  const double omega = 2 * std::numbers::pi * frequency_hz;
  const v1::Material& material = resolved.material();
  return omega * omega * material.density_kg_per_m3() * resolved.size() * resolved.size() /
         material.young_pa();
}

double WantedEigenvalue(const v1::CreateModalModelRequest& resolved) {
  return UnitEigenvalue(resolved, resolved.max_frequency_hz());
}

}  // namespace carillon
