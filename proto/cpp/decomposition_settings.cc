// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/decomposition_settings.h"

#include <cmath>
#include <set>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/shortest_decimal.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr int kMostFixtures = 16;
constexpr double kPoissonSteps = 1e4;  // of one

absl::Status Invalid(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

/// Checks the settings that may be zero or any finite number above.
absl::Status CheckFigures(const v1::DecompositionSettings& settings) {
  const v1::MeshSettings& mesh = settings.mesh();
  const std::pair<const char*, double> figures[] = {
      {"wall_m", mesh.wall_m()},
      {"accuracy", mesh.accuracy()},
      {"budget_s", mesh.budget_s()},
      {"budget_gib", mesh.budget_gib()},
      {"max_frequency_error", settings.max_frequency_error()}};
  for (const auto& [name, figure] : figures) {
    if (std::isfinite(figure) && figure >= 0) continue;
    return Invalid(absl::StrCat(name, " is ", figure, "; it must be zero or more"));
  }
  return absl::OkStatus();
}

absl::Status CheckFixtures(const v1::DecompositionSettings& settings) {
  for (const v1::Fixture& fixture : settings.fixtures()) {
    RETURN_IF_ERROR(FixtureText(fixture).status());
  }
  if (settings.fixtures_size() <= kMostFixtures) return absl::OkStatus();
  return Invalid(absl::StrCat("there are ", settings.fixtures_size(), " fixtures; at most ",
                              kMostFixtures, " are taken: fix a group, or a larger box"));
}

absl::Status CheckChoices(const v1::DecompositionSettings& settings) {
  if (v1::Element_IsValid(settings.element()) && v1::MassMatrix_IsValid(settings.mass_matrix()) &&
      v1::Solver_IsValid(settings.check_with())) {
    return absl::OkStatus();
  }
  return Invalid(
      "element, mass_matrix or check_with has a value that this program does not know; use a newer "
      "program, or a value that proto/carillon/v1/modal_model.proto lists");
}

absl::string_view KeepSurface(const v1::MeshSettings& mesh) {
  if (!mesh.has_keep_surface()) return "auto";
  return mesh.keep_surface() ? "yes" : "no";
}

/// The lines of settings that stand in the text only where they are not the default.
std::string LaterLines(const v1::DecompositionSettings& settings) {
  const v1::MeshSettings& mesh = settings.mesh();
  std::string text;
  const auto add = [&text](bool given, const auto&... words) {
    if (given) absl::StrAppend(&text, words..., "\n");
  };
  add(mesh.repair(), "repair yes");
  add(mesh.wall_m() > 0, "wall_m ", ShortestDecimal(mesh.wall_m()));
  add(mesh.accuracy() > 0, "accuracy ", ShortestDecimal(mesh.accuracy()));
  add(mesh.budget_s() > 0 || mesh.budget_gib() > 0, "budget ", ShortestDecimal(mesh.budget_s()),
      " ", ShortestDecimal(mesh.budget_gib()));
  add(settings.keep_mode_count() > 0, "keep ", settings.keep_mode_count());
  add(settings.max_frequency_error() > 0, "max_frequency_error ",
      ShortestDecimal(settings.max_frequency_error()));
  add(settings.check_with() == v1::SOLVER_SPECTRA, "check_with spectra");
  return text;
}

/// One line for each fixture, in alphabetical order, each once.
std::string FixtureLines(const v1::DecompositionSettings& settings) {
  std::set<std::string> fixtures;
  for (const v1::Fixture& fixture : settings.fixtures()) {
    fixtures.insert(FixtureText(fixture).value_or(""));
  }
  std::string text;
  for (const std::string& fixture : fixtures) absl::StrAppend(&text, "fix ", fixture, "\n");
  return text;
}

/// One line for each region of a body of several materials.
std::string RegionLines(const v1::DecompositionSettings& settings) {
  std::string text;
  for (const v1::RegionProperties& region : settings.regions()) {
    absl::StrAppend(&text, "region ", ShortestDecimal(region.relative_young()), " ",
                    ShortestDecimal(region.relative_density()), " ",
                    std::lround(region.poisson_ratio() * kPoissonSteps), " ",
                    absl::CEscape(region.region()), "\n");
  }
  return text;
}

}  // namespace

double RoundedPoissonRatio(double poisson_ratio) {
  return std::round(poisson_ratio * kPoissonSteps) / kPoissonSteps;
}

void FillInDefaults(v1::DecompositionSettings& settings) {
  if (settings.element() == v1::ELEMENT_UNSPECIFIED) settings.set_element(v1::ELEMENT_QUADRATIC);
  if (settings.mass_matrix() == v1::MASS_MATRIX_UNSPECIFIED) {
    settings.set_mass_matrix(v1::MASS_MATRIX_CONSISTENT);
  }
}

double MetresPerUnit(const v1::DecompositionSettings& settings) {
  return settings.metres_per_unit() == 0 ? 1 : settings.metres_per_unit();
}

absl::Status CheckSettings(const v1::DecompositionSettings& settings) {
  const double poisson_ratio = RoundedPoissonRatio(settings.poisson_ratio());
  if (!(poisson_ratio > -1 && poisson_ratio < 0.5)) {
    return Invalid(
        absl::StrCat("poisson_ratio is ", settings.poisson_ratio(), ", which is ", poisson_ratio,
                     " after rounding to 1e-4; it must be greater than -1 and less than 0.5, such "
                     "as 0.49 for rubber"));
  }
  if (!(std::isfinite(settings.metres_per_unit()) && settings.metres_per_unit() >= 0)) {
    return Invalid(absl::StrCat("metres_per_unit is ", settings.metres_per_unit(),
                                "; it must be greater than zero"));
  }
  RETURN_IF_ERROR(CheckFigures(settings));
  RETURN_IF_ERROR(CheckFixtures(settings));
  RETURN_IF_ERROR(CheckRegions(settings));
  if (settings.keep_mode_count() > kMaxKeptModeCount) {
    return Invalid(absl::StrCat("keep_mode_count is ", settings.keep_mode_count(),
                                "; it must be at most ", kMaxKeptModeCount));
  }
  return CheckChoices(settings);
}

std::string SettingsText(const v1::DecompositionSettings& settings) {
  return absl::StrCat(
      "poisson_1e-4 ", std::lround(settings.poisson_ratio() * kPoissonSteps), "\n",  //
      "element ", settings.element() == v1::ELEMENT_LINEAR ? "linear" : "quadratic", "\n", "mass ",
      settings.mass_matrix() == v1::MASS_MATRIX_LUMPED ? "lumped" : "consistent", "\n",
      "metres_per_unit ", ShortestDecimal(MetresPerUnit(settings)), "\n",  //
      "keep_surface ", KeepSurface(settings.mesh()), "\n",                 //
      "target_node_count ", settings.mesh().target_node_count(), "\n",     //
      LaterLines(settings), FixtureLines(settings), RegionLines(settings));
}

}  // namespace carillon
