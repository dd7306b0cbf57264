// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client_sdk/cli/commands/foley_command.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/value_options.h"
#include "proto/cpp/striker_catalogue.h"

namespace carillon::cli {
namespace {

/// Adds an option that takes PATTERN=VALUE, any number of times.
void AddChoice(CLI::App& app, const std::string& name, std::vector<BodyChoice>& choices,
               const std::string& description) {
  app.add_option_function<std::vector<std::string>>(
         name,
         [name, &choices](const std::vector<std::string>& words) {
           for (const std::string& word : words) {
             const size_t equals = word.rfind('=');
             if (equals == std::string::npos || equals == 0 || equals + 1 == word.size()) {
               throw CLI::ValidationError(
                   name, absl::StrCat("\"", word, "\" is not PATTERN=VALUE, such as 'Cup*=oak'"));
             }
             choices.emplace_back(word.substr(0, equals), word.substr(equals + 1));
           }
         },
         description)
      ->group("Bodies");
}

void AddBodies(CLI::App& foley, FoleyOptions& options) {
  AddChoice(foley, "--material", options.materials,
            "PATTERN=NAME: what bodies are made of; none keeps them silent. A glTF's material of "
            "the name of a catalogued one is taken by itself. A body that never moves is struck "
            "as of its material, and sounds only if it is named without a wildcard");
  AddChoice(foley, "--mesh", options.meshes, "PATTERN=FILE.obj: the surface of bodies, closed");
  AddChoice(foley, "--wall", options.walls,
            "PATTERN=METRES: bodies are hollow, with a wall of this thickness");
  AddChoice(foley, "--mass", options.masses,
            "PATTERN=KG: the mass in the simulation [the file's, or that of the material]");
  foley
      .add_option("--driven", options.driven,
                  "Bodies that are moved by hand, and not by contacts: a PATTERN")
      ->group("Bodies");
  foley.add_option("--repair", options.repaired, "Bodies whose surface is to be closed: a PATTERN")
      ->group("Bodies");
  foley
      .add_flag("--material-masses", options.material_masses,
                "Scale impulses to the masses that the materials give, where those of the "
                "simulation were not meant")
      ->group("Bodies");
}

void AddWorld(CLI::App& foley, FoleyOptions& options) {
  foley.add_option("--floor", options.floor_m,
                   "Add an endless floor at this height, m, against gravity");
  foley.add_option_function<std::string>(
      "--gravity",
      [&options](const std::string& text) {
        std::array<double, 3> g{};
        const std::vector<std::string> parts = absl::StrSplit(text, ',');
        bool good = text == "none" || parts.size() == 3;
        for (size_t i = 0; i < 3 && good && text != "none"; ++i) {
          good = absl::SimpleAtod(parts[i], &g[i]);
        }
        if (!good) throw CLI::ValidationError("--gravity", "must be X,Y,Z in m/s^2, or none");
        options.gravity_m_per_s2 = g;
      },
      "X,Y,Z in m/s^2, or none [0,-9.81,0 of a glTF, 0,0,-9.81 of a table]");
  foley
      .add_option("--unit", options.metres_per_unit,
                  "The unit of length of the file: m, cm, mm [m]")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, double>{{"m", 1}, {"cm", 0.01}, {"mm", 0.001}}));
  foley.add_flag("--frames-are-steps", options.frames_are_steps,
                 "Each frame is a step of the simulator, so that blows act at frames alone");
  TakeWithin(
      *foley.add_option("--friction", options.friction,
                        "The coefficient of friction of all bodies [that of the file, or 0.6]"),
      0, 10);
  foley
      .add_option("--striker", options.silent_striker,
                  absl::StrCat("What silent bodies strike like: ", StrikerNames()))
      ->capture_default_str();
  TakeWithin(*foley.add_option("--roughness", options.roughness_depth,
                               "The fluctuation of the force of what slides, relative to it [0]"),
             0, 10);
  foley.add_option("--listener", options.listener,
                   "The camera that hears [with two channels the first one]");
  foley.add_option("--cut", options.cuts_s,
                   "A time of the file, s, when the listener jumps, as in a cut from one camera to "
                   "another; otherwise it moves from one pose to the next");
}

}  // namespace

void AddFoley(CLI::App& app, Program& program) {
  auto options = std::make_shared<FoleyOptions>();
  CLI::App& foley = *app.add_subcommand(
      "foley", "Make an animation audible: find its contacts, and render them to a WAV file");
  foley
      .add_option("motion", options->file,
                  "An animated glTF (.glb, .gltf), or a table of poses (.csv, .npz)")
      ->required();
  foley.add_option("--out", options->sound.out, "The WAV file to write");
  foley.add_option("--trace", options->trace, "The contact trace to write (.contacts)");
  foley.add_option("--stems", options->stems, "A folder for the sound of each body alone");
  foley.add_flag("--list", options->list, "Show the bodies, and what is known of them, and end");
  foley.add_flag("--force", options->force,
                 "Render contacts that do not explain the motion, and repair open surfaces");
  AddBodies(foley, *options);
  AddWorld(foley, *options);
  AddSound(foley, options->sound);
  foley.callback([&program, options] {
    if (!options->list && options->sound.out.empty() && options->trace.empty()) {
      throw CLI::ValidationError("--out", "is needed, or --trace, or --list");
    }
    const std::string wrong =
        options->sound.out.empty() ? "" : WhyNotWritten(options->sound.out, {".wav", ".wave"});
    if (!wrong.empty()) throw CLI::ValidationError("--out", wrong);
    program.command = [&program, options] { return MakeFoley(program, *options); };
  });
}

}  // namespace carillon::cli
