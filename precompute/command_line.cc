// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "precompute/fixture_codec.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/fixture_text.h"
#include "proto/cpp/material_catalogue.h"

namespace carillon::precompute {
namespace {

/// The options as written, before they are made sense of.
struct Options {
  std::string input, output, format, material, matrices_folder;
  std::string element = "quadratic", mass = "consistent", unit = "m", band = "20:20000";
  std::optional<double> young_pa, poisson_ratio, density_kg_per_m3, alpha1_s, alpha2_per_s;
  std::optional<double> lambda_pa, mu_pa;
  double size = 1;
  std::string wall, accuracy, budget, loss_factor;
  std::vector<std::string> fixtures;
  bool keep_surface = false, refine_surface = false, repair = false, json = false;
  bool cautious = false;
  int node_count = 0, keep_count = 0, event_descriptor = -1, thread_count = 0;
};

absl::Status Invalid(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", message);
}

void AddMaterialOptions(CLI::App& app, Options& options) {
  const std::string group = "Material";
  app.add_option("--material", options.material, "A preset; the figures below override it")
      ->group(group);
  app.add_option("--young", options.young_pa, "Young's modulus, Pa")->group(group);
  app.add_option("--poisson", options.poisson_ratio, "Poisson's ratio, above -1 and below 0.5")
      ->group(group);
  app.add_option("--lame-lambda", options.lambda_pa, "Lame's first constant, Pa, with --lame-mu")
      ->group(group);
  app.add_option("--lame-mu", options.mu_pa, "Shear modulus, Pa, with --lame-lambda")->group(group);
  app.add_option("--density", options.density_kg_per_m3, "Density, kg/m^3")->group(group);
  app.add_option("--alpha1", options.alpha1_s, "Damping in proportion to stiffness, s")
      ->group(group);
  app.add_option("--alpha2", options.alpha2_per_s, "Damping in proportion to mass, 1/s")
      ->group(group);
  app.add_option("--loss-factor", options.loss_factor,
                 "Damping added by a loss factor: ETA, or HZ:ETA,HZ:ETA,...")
      ->group(group);
}

void AddMeshOptions(CLI::App& app, Options& options) {
  const std::string group = "Mesh";
  app.add_option(
         "--format", options.format,
         "obj, ply, stl, off, msh (Gmsh), mesh (Medit) or node (TetGen; default: by the suffix)")
      ->group(group);
  app.add_option("--unit", options.unit,
                 "Unit of the file's coordinates: m, mm, cm, in, or a number of metres")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--repair", options.repair,
               "Mend a surface that is no closed body: gently first, else by wrapping it; the "
               "warnings say what was done and how far it went")
      ->group(group);
  app.add_option("--wall", options.wall,
                 "Hollow the body out to a wall so thick, or thicken an open sheet: a number with "
                 "m, mm, cm or in, or of metres")
      ->group(group);
  app.add_flag("--keep-surface", options.keep_surface, "Add no vertices on the surface")
      ->group(group);
  app.add_flag("--refine-surface", options.refine_surface, "Add vertices on the surface as needed")
      ->excludes("--keep-surface")
      ->group(group);
  app.add_flag("--cautious", options.cautious,
               "Mesh with a coarser tolerance and rougher elements, where the mesher fails")
      ->group(group);
  app.add_option("--nodes", options.node_count,
                 "About how many corner nodes (default: by the surface)")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--accuracy", options.accuracy,
                 "Mesh so finely that no mode is estimated to be off by more, such as 1% or 0.01")
      ->group(group);
  app.add_option("--budget", options.budget,
                 "SECONDS[:GIB] of processor time and memory: mesh as finely as they allow")
      ->group(group);
  app.add_option(
         "--fix", options.fixtures,
         "Hold the body where it touches or lies behind a plane, in a box, at vertices or in a "
         "group of the file; repeat it for more. plane:X,Y,Z/NX,NY,NZ (the normal points to what "
         "is free), box:X,Y,Z/X,Y,Z, vertices:I,J,... or group:NAME, in metres")
      ->allow_extra_args(false)
      ->group(group);
  app.add_option("--element", options.element, "Order of the elements")
      ->check(CLI::IsMember({"linear", "quadratic"}))
      ->capture_default_str()
      ->group(group);
  app.add_option("--mass", options.mass, "Mass matrix")
      ->check(CLI::IsMember({"lumped", "consistent"}))
      ->capture_default_str()
      ->group(group);
}

void AddOptions(CLI::App& app, Options& options) {
  app.add_option(
         "IN", options.input,
         "Mesh file: a closed surface, or tetrahedra (msh, mesh, node with the ele beside it)")
      ->required();
  app.add_option("--out", options.output, "Where to write the modal model")->required();
  AddMaterialOptions(app, options);
  AddMeshOptions(app, options);
  app.add_option("--size", options.size, "Size that the body will have, relative to the mesh")
      ->capture_default_str();
  app.add_option("--band", options.band,
                 "LO:HI in Hz: all modes up to natural HI are computed, one must lie in the band")
      ->capture_default_str();
  app.add_option("--keep", options.keep_count,
                 "Keep only so many modes, the most audible of a strike anywhere on the surface; "
                 "for bodies of more than 5000 modes")
      ->check(CLI::Range(0, kMaxModeCount));
  app.add_option("--matrices", options.matrices_folder,
                 "Folder for K.mtx and M.mtx (Matrix Market, SI, nodes in the file's order, three "
                 "unknowns a node)");
  app.add_flag("--json", options.json, "Print one JSON object");
  app.add_option("--threads", options.thread_count, "Threads (default: one a processor)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--events-fd", options.event_descriptor,
                 "Open descriptor for carillon.v1.WorkerEvent messages")
      ->check(CLI::NonNegativeNumber);
}

/// Young's modulus and Poisson's ratio, from either pair of constants.
absl::Status SetElasticity(const Options& options, v1::Material& material) {
  if (options.lambda_pa.has_value() != options.mu_pa.has_value()) {
    return Invalid("--lame-lambda and --lame-mu belong together; give both");
  }
  if (options.lambda_pa && (options.young_pa || options.poisson_ratio)) {
    return Invalid(
        "--lame-lambda and --lame-mu say the same as --young and --poisson; give one pair");
  }
  if (options.lambda_pa) {
    const ElasticConstants elastic =
        FromLame({.lambda_pa = *options.lambda_pa, .mu_pa = *options.mu_pa});
    material.set_young_pa(elastic.young_pa);
    material.set_poisson_ratio(elastic.poisson_ratio);
  }
  if (options.young_pa) material.set_young_pa(*options.young_pa);
  if (options.poisson_ratio) material.set_poisson_ratio(*options.poisson_ratio);
  return absl::OkStatus();
}

/// The material with every figure present; damping that nobody gave is none.
absl::StatusOr<v1::Material> MakeMaterial(const Options& options) {
  v1::Material material;
  material.set_preset(options.material);
  if (absl::Status status = SetElasticity(options, material); !status.ok()) return status;
  if (options.density_kg_per_m3) material.set_density_kg_per_m3(*options.density_kg_per_m3);
  if (options.alpha1_s || options.material.empty()) {
    material.set_alpha1_s(options.alpha1_s.value_or(0));
  }
  if (options.alpha2_per_s || options.material.empty()) {
    material.set_alpha2_per_s(options.alpha2_per_s.value_or(0));
  }
  if (!options.loss_factor.empty()) {
    const absl::StatusOr<std::vector<LossFactorPoint>> points = ReadLossFactor(options.loss_factor);
    if (!points.ok()) return points.status();
    SetLossFactor(*points, material);
  }
  if (options.material.empty() && !(material.has_young_pa() && material.has_poisson_ratio() &&
                                    material.has_density_kg_per_m3())) {
    return Invalid(
        "no material: give --material NAME, or --young, --poisson (or --lame-lambda, "
        "--lame-mu) and --density");
  }
  return ResolveMaterial(material);
}

absl::Status SetBand(const std::string& band, IntendedUse& use) {
  const std::vector<std::string> ends = absl::StrSplit(band, ':');
  const bool two_numbers = ends.size() == 2 && absl::SimpleAtod(ends[0], &use.low_hz) &&
                           absl::SimpleAtod(ends[1], &use.high_hz);
  if (two_numbers && use.low_hz >= 0 && use.low_hz < use.high_hz && std::isfinite(use.high_hz)) {
    return absl::OkStatus();
  }
  return Invalid(absl::StrCat("--band is \"", band,
                              "\"; it must be two frequencies in Hz, the lower "
                              "first, such as 20:20000"));
}

absl::StatusOr<IntendedUse> MakeUse(const Options& options, const v1::Material& material) {
  if (!(options.size > 0) || !std::isfinite(options.size)) {
    return Invalid(absl::StrCat("--size is ", options.size, "; it must be above zero"));
  }
  IntendedUse use{.young_pa = material.young_pa(),
                  .density_kg_per_m3 = material.density_kg_per_m3(),
                  .alpha1_s = material.alpha1_s(),
                  .alpha2_per_s = material.alpha2_per_s(),
                  .size = options.size,
                  .loss_factor = LossFactorOf(material)};
  if (absl::Status status = SetBand(options.band, use); !status.ok()) return status;
  return use;
}

absl::StatusOr<double> MetresPerUnit(const std::string& unit) {
  const std::map<std::string, double> metres = {
      {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}};
  if (const auto named = metres.find(unit); named != metres.end()) return named->second;
  double number = 0;
  if (absl::SimpleAtod(unit, &number) && number > 0 && std::isfinite(number)) return number;
  return Invalid(absl::StrCat("--unit is \"", unit,
                              "\"; it must be m, mm, cm, in, or a number of metres above zero"));
}

/// Of the body as large as its file and unit make it; empty: none.
absl::StatusOr<double> WallM(const std::string& wall) {
  if (wall.empty()) return 0;
  const size_t digits = std::min(wall.find_first_not_of("0123456789.eE+-"), wall.size());
  const absl::StatusOr<double> unit =
      digits == wall.size() ? 1.0 : MetresPerUnit(wall.substr(digits));
  double number = 0;
  if (unit.ok() && absl::SimpleAtod(wall.substr(0, digits), &number) && number > 0 &&
      std::isfinite(number)) {
    return number * *unit;
  }
  return Invalid(absl::StrCat("--wall is \"", wall,
                              "\"; it must be a length above zero, such as 3mm or 0.003"));
}

absl::StatusOr<ResolutionGoal> MakeGoal(const Options& options) {
  ResolutionGoal goal;
  if (!options.accuracy.empty()) {
    const bool percent = absl::EndsWith(options.accuracy, "%");
    const absl::string_view digits = absl::StripSuffix(options.accuracy, "%");
    if (!absl::SimpleAtod(digits, &goal.accuracy) || !(goal.accuracy > 0) ||
        !std::isfinite(goal.accuracy)) {
      return Invalid(absl::StrCat("--accuracy is \"", options.accuracy,
                                  "\"; it must be above zero, such as 1% or 0.01"));
    }
    if (percent) goal.accuracy /= 100;
  }
  if (options.budget.empty()) return goal;
  const std::vector<std::string> parts = absl::StrSplit(options.budget, ':');
  double gib = 0;
  const bool numbers = parts.size() <= 2 && absl::SimpleAtod(parts[0], &goal.budget_s) &&
                       (parts.size() == 1 || absl::SimpleAtod(parts[1], &gib));
  if (!numbers || !(goal.budget_s >= 0 && gib >= 0) || !std::isfinite(goal.budget_s + gib)) {
    return Invalid(absl::StrCat("--budget is \"", options.budget,
                                "\"; it must be seconds, or seconds:GiB, such as 60 or 60:4"));
  }
  goal.budget_bytes = gib * 1024 * 1024 * 1024;
  return goal;
}

absl::StatusOr<std::vector<Fixture>> MakeFixtures(const Options& options) {
  std::vector<Fixture> fixtures;
  for (const std::string& text : options.fixtures) {
    const absl::StatusOr<v1::Fixture> said = ParseFixture(text);
    if (!said.ok()) return said.status();
    fixtures.push_back(FromProto(*said));
  }
  return fixtures;
}

absl::StatusOr<MeshFile> MakeMeshFile(const Options& options) {
  const absl::StatusOr<double> metres_per_unit = MetresPerUnit(options.unit);
  if (!metres_per_unit.ok()) return metres_per_unit.status();
  std::string format = options.format;
  if (format.empty()) {
    format = std::filesystem::path(options.input).extension().string();
    if (!format.empty()) format.erase(0, 1);
  }
  format = absl::AsciiStrToLower(format);
  return MeshFile{.path = options.input,
                  .format = format == "ele" ? "node" : format,
                  .metres_per_unit = *metres_per_unit};
}

absl::StatusOr<CommandLine> MakeCommandLine(const Options& options) {
  const absl::StatusOr<v1::Material> material = MakeMaterial(options);
  if (!material.ok()) return material.status();
  const absl::StatusOr<IntendedUse> use = MakeUse(options, *material);
  if (!use.ok()) return use.status();
  const absl::StatusOr<MeshFile> mesh = MakeMeshFile(options);
  if (!mesh.ok()) return mesh.status();
  const absl::StatusOr<double> wall_m = WallM(options.wall);
  if (!wall_m.ok()) return wall_m.status();
  const absl::StatusOr<ResolutionGoal> goal = MakeGoal(options);
  if (!goal.ok()) return goal.status();
  absl::StatusOr<std::vector<Fixture>> fixtures = MakeFixtures(options);
  if (!fixtures.ok()) return fixtures.status();
  CommandLine result{
      .mesh = *mesh,
      .output = options.output,
      .settings = {.poisson_ratio = material->poisson_ratio(),
                   .mass =
                       options.mass == "lumped" ? MassSharing::kLumped : MassSharing::kConsistent,
                   .fixtures = *std::move(fixtures),
                   .preparation = {.repair = options.repair, .wall_m = *wall_m},
                   .meshing = {.keep_surface = {},
                               .target_node_count = options.node_count,
                               .nodes_per_element = options.element == "linear" ? 4 : 10},
                   .use = *use,
                   .resolution = *goal,
                   .keep_mode_count = options.keep_count,
                   .matrices_folder = options.matrices_folder},
      .json = options.json,
      .event_descriptor = options.event_descriptor,
      .thread_count = options.thread_count,
      .message = {}};
  if (options.keep_surface) result.settings.meshing.keep_surface = true;
  if (options.refine_surface) result.settings.meshing.keep_surface = false;
  result.settings.meshing.cautious = options.cautious;
  return result;
}

}  // namespace

absl::StatusOr<CommandLine> ParseCommandLine(int argc, const char* const* argv) {
  CLI::App app("Computes the vibration modes of a body from its surface or tetrahedra.",
               "carillon-precompute");
  app.set_version_flag("--version", CARILLON_VERSION);
  Options options;
  AddOptions(app, options);
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
    return Invalid(absl::StrCat(error.what(), "; carillon-precompute --help lists the options"));
  }
  return MakeCommandLine(options);
}

}  // namespace carillon::precompute
