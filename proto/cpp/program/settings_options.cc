// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/settings_options.h"

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>

#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/program/parsed_option.h"
#include "proto/cpp/program/quantity.h"

namespace carillon {
namespace {

using Settings = v1::DecompositionSettings;

constexpr char kShareForm[] =
    "above zero and below 100%, such as 1% or 0.01; a number without % is a fraction: 1 is 100%";

/// Adds an option that takes one of some words, each of which stands for a value.
template <class T, class Take>
void AddChoice(CLI::App& app, const std::string& name, const std::map<std::string, T>& values,
               const std::string& description, Take take) {
  app.add_option_function<std::string>(
         name, [=](const std::string& word) { take(values.at(word)); }, description)
      ->check(CLI::IsMember(values))
      ->group(kSettingsGroup);
}

/// Zero stands for a body without a wall.
std::optional<double> ParseWallM(const std::string& text) {
  return text == "0" ? std::optional(0.0) : ParseLengthM(text);
}

void AddBody(CLI::App& app, Settings& settings) {
  AddParsed(app, "--unit", ParseUnitM, "m, mm, cm, in, or a number of metres above zero",
            "unit of the file's coordinates: m, mm, cm, in, or a number of metres [m]",
            [&](double metres) { settings.set_metres_per_unit(metres); })
      ->group(kSettingsGroup);
  app.add_flag_function(
         "--repair", [&](int64_t) { settings.mutable_mesh()->set_repair(true); },
         "repair a surface that does not bound one body: gently first, else by wrapping it; the "
         "model's warnings say what was done and how far the surface moved")
      ->group(kSettingsGroup);
  AddParsed(app, "--wall", ParseWallM, "a length, such as 3mm or 0.003, or 0 for no wall",
            "hollow the body out to a wall of this thickness, or thicken an open sheet: a number "
            "with m, mm, cm or in, or of metres",
            [&](double metres) { settings.mutable_mesh()->set_wall_m(metres); })
      ->group(kSettingsGroup);
  app.add_option_function<std::string>(
         "--fix",
         [&](const std::string& text) {
           const absl::StatusOr<v1::Fixture> fixture = ParseFixture(text);
           if (!fixture.ok()) {
             throw CLI::ValidationError("--fix", ToErrorInfo(fixture.status()).message());
           }
           *settings.add_fixtures() = *fixture;
         },
         "fix the body where it touches or lies behind a plane, in a box, at vertices or in a "
         "group of the file; repeat it for more: plane:X,Y,Z/NX,NY,NZ (the normal points to the "
         "free side), box:X,Y,Z/X,Y,Z, vertices:I,J,... or group:NAME, in metres")
      ->allow_extra_args(false)
      ->trigger_on_parse()
      ->group(kSettingsGroup);
}

void AddMesh(CLI::App& app, Settings& settings) {
  CLI::Option* const keep =
      app.add_flag_function(
             "--keep-surface", [&](int64_t) { settings.mutable_mesh()->set_keep_surface(true); },
             "add no vertices on the surface [decided from the surface]")
          ->group(kSettingsGroup);
  app.add_flag_function(
         "--refine-surface", [&](int64_t) { settings.mutable_mesh()->set_keep_surface(false); },
         "add vertices on the surface as needed [decided from the surface]")
      ->excludes(keep)
      ->group(kSettingsGroup);
  app.add_option_function<uint32_t>(
         "--nodes", [&](uint32_t count) { settings.mutable_mesh()->set_target_node_count(count); },
         "about this many corner nodes [decided from the surface]")
      ->check(CLI::Range(0, 100'000'000))
      ->group(kSettingsGroup);
  AddParsed(app, "--accuracy", ParseShare, kShareForm,
            "mesh so finely that no mode is estimated to be off by more, such as 1% or 0.01",
            [&](double share) { settings.mutable_mesh()->set_accuracy(share); })
      ->group(kSettingsGroup);
  AddParsed(
      app, "--budget", ParseBudget,
      "seconds, or seconds:GiB, such as 60 or 60:4, not both zero; leave it out for the default",
      "SECONDS[:GIB] of processor time and memory: mesh as finely as they allow",
      [&](const Budget& budget) {
        settings.mutable_mesh()->set_budget_s(budget.seconds);
        settings.mutable_mesh()->set_budget_gib(budget.gib);
      })
      ->group(kSettingsGroup);
  AddChoice<v1::Element>(app, "--element",
                         {{"linear", v1::ELEMENT_LINEAR}, {"quadratic", v1::ELEMENT_QUADRATIC}},
                         "order of the elements [quadratic]",
                         [&](v1::Element element) { settings.set_element(element); });
  AddChoice<v1::MassMatrix>(
      app, "--mass",
      {{"lumped", v1::MASS_MATRIX_LUMPED}, {"consistent", v1::MASS_MATRIX_CONSISTENT}},
      "mass matrix [consistent]", [&](v1::MassMatrix mass) { settings.set_mass_matrix(mass); });
}

void AddModes(CLI::App& app, Settings& settings) {
  app.add_option_function<uint32_t>(
         "--keep", [&](uint32_t count) { settings.set_keep_mode_count(count); },
         "keep only this many modes, the most audible of a strike anywhere on the surface; for "
         "bodies of more than 5000 modes")
      ->check(CLI::Range(0, kMaxKeptModeCount))
      ->group(kSettingsGroup);
  AddParsed(app, "--max-frequency-error", ParseShare, kShareForm,
            "leave out modes whose frequency is estimated to be off by more, such as 2% or 0.02",
            [&](double share) { settings.set_max_frequency_error(share); })
      ->group(kSettingsGroup);
  AddChoice<v1::Solver>(app, "--check-with", {{"spectra", v1::SOLVER_SPECTRA}},
                        "find the modes with this solver, too, and say how far apart both are",
                        [&](v1::Solver solver) { settings.set_check_with(solver); });
}

}  // namespace

void AddSettingsOptions(CLI::App& app, v1::DecompositionSettings& settings) {
  AddBody(app, settings);
  AddMesh(app, settings);
  AddModes(app, settings);
}

}  // namespace carillon
