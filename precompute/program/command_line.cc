// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/command_line.h"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/program/settings_options.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// The options that take more than a field of the request to understand, as written.
struct Options {
  std::string format, request_file;
  std::vector<std::string> materials;
  std::string band;
  std::optional<double> young_pa, poisson_ratio, density_kg_per_m3, alpha1_s, alpha2_per_s;
  std::string loss_factor;
};

constexpr char kMaterialGroup[] = "Material";
constexpr char kUseGroup[] = "Intended use";
constexpr char kRadiationGroup[] = "Radiation";
constexpr int kMostThreads = 4096;

/// CLI11's own check states the largest double as the limit.
const CLI::Validator& AboveZero() {
  static const CLI::Validator validator(
      [](const std::string& text) {
        double value = 0;
        const bool is_above = absl::SimpleAtod(text, &value) && value > 0 && std::isfinite(value);
        return is_above ? std::string()
                        : absl::StrCat("\"", text, "\" must be a number above zero");
      },
      "NUMBER");
  return validator;
}

absl::Status InvalidOption(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", message);
}

void AddMaterialOptions(CLI::App& app, Options& options) {
  const std::string group = kMaterialGroup;
  app.add_option("--material", options.materials,
                 "A preset, or REGION=PRESET for a region of the file; the figures below override "
                 "the first")
      ->allow_extra_args(false)
      ->group(group);
  app.add_option("--young", options.young_pa, "Young's modulus, Pa")->group(group);
  app.add_option("--poisson", options.poisson_ratio, "Poisson's ratio, above -1 and below 0.5")
      ->group(group);
  app.add_option("--density", options.density_kg_per_m3, "Density, kg/m^3")->group(group);
  app.add_option("--alpha1", options.alpha1_s, "Damping in proportion to stiffness, s")
      ->group(group);
  app.add_option("--alpha2", options.alpha2_per_s, "Damping in proportion to mass, 1/s")
      ->group(group);
  app.add_option("--loss-factor", options.loss_factor,
                 "Damping added by a loss factor: ETA, or HZ:ETA,HZ:ETA,...")
      ->group(group);
}

/// Zero means the default to the request, but a person who writes it errs.
void SetSize(double size, worker::v1::WorkerRequest& request) {
  if (!(size > 0)) throw CLI::ValidationError("--size", "it must be above zero");
  request.set_size(size);
}

void AddUseOptions(CLI::App& app, Options& options, worker::v1::WorkerRequest& request) {
  app.add_option(
         "--format", options.format,
         "obj, ply, stl, off, glb, gltf, msh (Gmsh), mesh (Medit), node (TetGen) or inp (Abaqus, "
         "CalculiX; default: by the suffix)")
      ->group(kUseGroup);
  app.add_option_function<double>(
         "--size", [&](double size) { SetSize(size, request); },
         "Size that the body will have, relative to the mesh [1]")
      ->group(kUseGroup);
  app.add_option(
         "--band", options.band,
         "LO:HI or HI in Hz: all modes up to HI (natural frequency) are computed; at least one "
         "must lie between LO and HI "
         "[20:20000; fewer modes where those are too many for 7 GiB or a minute]")
      ->group(kUseGroup);
  app.add_flag_function(
         "--cautious", [&](int64_t) { request.set_cautious(true); },
         "Mesh with a coarser tolerance and rougher elements, where the mesher fails")
      ->group(kUseGroup);
}

void AddRadiationOptions(CLI::App& app, worker::v1::WorkerRequest& request) {
  app.add_flag_function(
         "--transfer", [&](int64_t) { request.mutable_transfer(); },
         "Compute how each mode radiates into the air, too, for the material's speed of sound: "
         "power, directions, decay by radiation")
      ->group(kRadiationGroup);
  app.add_flag_function(
         "--radiate", [&](int64_t) { request.set_radiate_stored_model(true); },
         "IN is a stored modal model; compute how its modes radiate, and nothing else")
      ->group(kRadiationGroup);
  app.add_option_function<double>(
         "--transfer-accuracy",
         [&](double accuracy_db) { request.mutable_transfer()->set_accuracy_db(accuracy_db); },
         "Estimated error of each mode's radiated power that is good enough, dB [2]")
      ->check(CLI::Range(0.06, 20.0))
      ->group(kRadiationGroup);
  app.add_option_function<double>(
         "--transfer-budget",
         [&](double budget_s) { request.mutable_transfer()->set_budget_s(budget_s); },
         "Seconds of processor time after which no further mode is begun; low modes come first, "
         "then the loudest [about as long as the modes take, from 20 to 600]")
      ->check(AboveZero())
      ->group(kRadiationGroup);
}

/// Adds --request, which stands for all options of the groups above.
void AddRequestFile(CLI::App& app, Options& options) {
  CLI::Option* const file = app.add_option(
      "--request", options.request_file,
      "File with a carillon.v1.WorkerRequest in protobuf's text form; it replaces all options of "
      "the groups Material, Decomposition, Intended use and Radiation");
  for (const char* group : {kMaterialGroup, kSettingsGroup, kUseGroup, kRadiationGroup}) {
    const auto in_group = [&](const CLI::Option* option) { return option->get_group() == group; };
    for (CLI::Option* option : app.get_options(in_group)) file->excludes(option);
  }
}

void AddOptions(CLI::App& app, Options& options, CommandLine& result) {
  app.add_option("IN", result.input,
                 "Mesh file: a closed surface, or tetrahedra (msh, mesh, inp, node with the ele "
                 "beside it); "
                 "with --radiate a stored modal model")
      ->required();
  app.add_option("--out", result.output,
                 "Where to write the modal model, or the radiation with --radiate")
      ->required();
  app.add_option("--transfer-out", result.transfer_output,
                 "Where to write the radiation with --transfer [OUT.transfer]");
  AddMaterialOptions(app, options);
  AddSettingsOptions(app, *result.request.mutable_settings());
  AddUseOptions(app, options, result.request);
  AddRadiationOptions(app, result.request);
  AddRequestFile(app, options);
  app.add_flag("--json", result.json, "Print one JSON object");
  app.add_option("--threads", result.thread_count, "Threads (default: one a processor)")
      ->check(CLI::Range(0, kMostThreads));
  app.add_option("--events-fd", result.event_descriptor,
                 "Open descriptor for carillon.v1.WorkerEvent messages")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
}

/// Checks that a material without a preset has all figures without a default.
absl::Status CheckComplete(const v1::Material& material) {
  if (!material.preset().empty()) return absl::OkStatus();
  std::vector<std::string> missing;
  if (!material.has_young_pa()) missing.emplace_back("--young");
  if (!material.has_poisson_ratio()) missing.emplace_back("--poisson");
  if (!material.has_density_kg_per_m3()) missing.emplace_back("--density");
  if (missing.empty()) return absl::OkStatus();
  constexpr size_t kAll = 3;
  return InvalidOption(
      absl::StrCat(missing.size() == kAll ? "no material" : "the material is not complete",
                   ": give ", absl::StrJoin(missing, ", "), ", or --material NAME"));
}

/// A field of a material, and the option that sets it.
struct MaterialOption {
  const char* field;
  const char* option;
};
constexpr std::array<MaterialOption, 7> kMaterialOptions = {
    {{"young_pa", "--young"},
     {"poisson_ratio", "--poisson"},
     {"density_kg_per_m3", "--density"},
     {"alpha1_s", "--alpha1"},
     {"alpha2_per_s", "--alpha2"},
     {"loss_factor.frequency_hz", "a frequency of --loss-factor"},
     {"loss_factor.loss_factor", "a value of --loss-factor"}}};

/// Returns the refusal of a material with the option in place of the field that it begins with.
absl::Status NamingOptions(const absl::Status& refusal) {
  const v1::ErrorInfo error = ToErrorInfo(refusal);
  if (error.reason() != "INVALID_MATERIAL") return refusal;
  for (const auto& [field, option] : kMaterialOptions) {
    const std::string begin = absl::StrCat(field, " ");
    if (!absl::StartsWith(error.message(), begin)) continue;
    return Refusal(refusal.code(), error.reason(),
                   absl::StrCat(option, " ", error.message().substr(begin.size())));
  }
  return refusal;
}

/// The material with every figure present; damping that nobody gave is none.
absl::StatusOr<v1::Material> MakeMaterial(const Options& options) {
  v1::Material material;
  std::vector<std::string> regions;
  for (const std::string& text : options.materials) {
    const bool is_region = absl::StrContains(text, '=');
    if (is_region) regions.push_back(text);
    if (!is_region && !material.preset().empty()) {
      return InvalidOption("--material is given twice: only regions have several (REGION=NAME)");
    }
    if (!is_region) material.set_preset(text);
  }
  const bool is_named = !options.materials.empty();
  if (options.young_pa) material.set_young_pa(*options.young_pa);
  if (options.poisson_ratio) material.set_poisson_ratio(*options.poisson_ratio);
  if (options.density_kg_per_m3) material.set_density_kg_per_m3(*options.density_kg_per_m3);
  if (options.alpha1_s || !is_named) {
    material.set_alpha1_s(options.alpha1_s.value_or(0));
  }
  if (options.alpha2_per_s || !is_named) {
    material.set_alpha2_per_s(options.alpha2_per_s.value_or(0));
  }
  if (!options.loss_factor.empty()) {
    ASSIGN_OR_RETURN(const std::vector<LossFactorPoint> points,
                     ReadLossFactor(options.loss_factor));
    SetLossFactor(points, material);
  }
  if (regions.empty() || material.ByteSizeLong() > 0) RETURN_IF_ERROR(CheckComplete(material));
  AddRegions(regions, material);
  absl::StatusOr<v1::Material> resolved = ResolveMaterial(material);
  if (!resolved.ok()) return NamingOptions(resolved.status());
  return resolved;
}

/// Lower end of the band where nobody asks for one. An upper end of zero is the default.
constexpr double kUsualLowestHz = 20;

absl::Status SetBand(const std::string& band, worker::v1::WorkerRequest& request) {
  if (band.empty()) {
    request.set_min_frequency_hz(kUsualLowestHz);
    return absl::OkStatus();
  }
  const std::vector<std::string> ends = absl::StrSplit(band, ':');
  double low_hz = kUsualLowestHz;
  double high_hz = 0;
  const bool numbers = ends.size() <= 2 && absl::SimpleAtod(ends.back(), &high_hz) &&
                       (ends.size() == 1 || absl::SimpleAtod(ends.front(), &low_hz));
  request.set_min_frequency_hz(low_hz);
  request.set_max_frequency_hz(high_hz);
  const bool is_default = ends.size() == 1 && high_hz == 0;
  if (numbers && low_hz >= 0 && (is_default || low_hz < high_hz) && std::isfinite(high_hz)) {
    return absl::OkStatus();
  }
  return InvalidOption(absl::StrCat("--band is \"", band,
                                    "\"; it must be the highest frequency in Hz, such as 8000, or "
                                    "two frequencies, the lower first, such as 20:20000"));
}

std::string FormatOf(const std::string& format, const std::string& file) {
  const std::string named = format.empty() ? MeshFormatOf(file) : absl::AsciiStrToLower(format);
  return named == "ele" ? "node" : named;
}

absl::StatusOr<worker::v1::WorkerRequest> MakeRequest(const Options& options,
                                                      const std::string& mesh_file,
                                                      worker::v1::WorkerRequest request) {
  if (!options.request_file.empty()) return ReadWorkerRequest(options.request_file);
  ASSIGN_OR_RETURN(*request.mutable_material(), MakeMaterial(options));
  request.mutable_settings()->set_poisson_ratio(request.material().poisson_ratio());
  RETURN_IF_ERROR(SetBand(options.band, request));
  request.set_mesh_format(FormatOf(options.format, mesh_file));
  return Complete(std::move(request));
}

}  // namespace

absl::StatusOr<CommandLine> ParseCommandLine(int argc, const char* const* argv) {
  CLI::App app("Computes the vibration modes of a body from its surface or tetrahedra.",
               "carillon-precompute");
  app.set_version_flag("--version", CARILLON_VERSION);
  Options options;
  CommandLine result;
  AddOptions(app, options, result);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    CommandLine help;
    help.message = app.help();
    return help;
  } catch (const CLI::CallForVersion&) {
    CommandLine version;
    version.message = absl::StrCat(CARILLON_VERSION, "\n");
    return version;
  } catch (const CLI::Error& error) {
    return InvalidOption(
        absl::StrCat(error.what(), "; carillon-precompute --help lists the options"));
  }
  ASSIGN_OR_RETURN(result.request, MakeRequest(options, result.input, std::move(result.request)));
  if (result.request.radiate_stored_model()) result.transfer_output = result.output;
  if (result.transfer_output.empty()) {
    result.transfer_output = absl::StrCat(result.output, ".transfer");
  }
  return result;
}

}  // namespace carillon::precompute
