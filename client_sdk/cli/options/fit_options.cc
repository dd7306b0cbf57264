// SPDX-License-Identifier: Apache-2.0
//
// The command lines of `carillon material extract` and `carillon material fit`.

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <string>

#include "client_sdk/cli/commands/fit_commands.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/value_options.h"

namespace carillon::cli {
namespace {

void AddExtract(CLI::App& material, Program& program) {
  auto options = std::make_shared<ExtractOptions>();
  CLI::App& extract = *material.add_subcommand(
      "extract", "List the frequencies and the decays of recorded strikes on one body");
  extract.add_option("recordings", options->recordings, "WAV, AIFF, FLAC, Ogg or MP3 files")
      ->required();
  extract.add_option("--out", options->out, "The CSV file to write, too, which fit --modes reads");
  extract.callback([&program, options] {
    program.command = [&program, options] { return ExtractModesOf(*options, program.json); };
  });
}

/// Reads "LO:HI", Young's moduli in Pa.
CLI::Validator YoungRange(fit::FitSettings& settings) {
  return CLI::Validator(
      [&settings](std::string& text) -> std::string {
        const size_t colon = text.find(':');
        double low = 0, high = 0;
        const bool read =
            colon != std::string::npos && CLI::detail::lexical_cast(text.substr(0, colon), low) &&
            CLI::detail::lexical_cast(text.substr(colon + 1), high) && low >= 1e5 && high > low;
        if (!read) return text + " is not two moduli LO:HI in Pa, such as 60e9:80e9";
        settings.least_young_pa = low;
        settings.most_young_pa = high;
        return {};
      },
      "LO:HI");
}

void AddKnown(CLI::App& fit, const std::shared_ptr<FitOptions>& options) {
  CLI::Option* mass =
      fit.add_option("--mass", options->settings.mass_kg, "The mass of the first body, kg");
  TakeWithin(*mass, 1e-9, 1e9, "weigh the body");
  CLI::Option* density =
      fit.add_option("--density", options->settings.density_kg_per_m3, "The density, kg/m^3");
  TakeWithin(*density, 1e-3, 1e6, "leave it out where the mass is given");
  density->excludes(mass);
  TakeWithin(*fit.add_option("--poisson", options->settings.poisson_ratio,
                             "Poisson's ratio, if it is known [found, near 0.28 +- 0.10]"),
             -0.2, 0.49, "leave it out to have it found");
  fit.add_option_function<std::string>(
         "--young-range", [options](const std::string& /*checked*/) {},
         "The range of Young's modulus, Pa [that of sqrt(E/rho) from 900 to 7500 m/s]")
      ->check(YoungRange(options->settings));
  const std::map<std::string, fit::DampingKind> laws = {{"auto", fit::DampingKind::kAuto},
                                                        {"eta", fit::DampingKind::kEta},
                                                        {"table", fit::DampingKind::kTable},
                                                        {"rayleigh", fit::DampingKind::kRayleigh}};
  fit.add_option("--damping", options->settings.damping,
                 "The law of damping: a loss factor (eta), a table of it, Rayleigh's, or the one "
                 "that the decays bear out [auto]")
      ->transform(CLI::CheckedTransformer(laws, CLI::ignore_case).description(""));
}

void AddFit(CLI::App& material, Program& program) {
  auto options = std::make_shared<FitOptions>();
  CLI::App& fit = *material.add_subcommand(
      "fit", "Find the material of a body from recorded strikes and its model");
  fit.add_option("model", options->model,
                 "The name, the label, or the first digits of the digest of the body's model")
      ->required();
  CLI::Option* recordings =
      fit.add_option("recordings", options->recordings, "WAV, AIFF, FLAC, Ogg or MP3 files");
  CLI::Option* modes =
      fit.add_option("--modes", options->modes, "A CSV file of modes that were measured elsewhere")
          ->excludes(recordings);
  fit.add_option(
      "--and", options->others,
      "A further body of the same material: its model and its recordings (may be repeated)");
  AddKnown(fit, options);
  fit.add_option("--out", options->out, "The file for the material, which --material-file reads")
      ->check([](const std::string& path) {
        return WhyNotWritten(path, {".textproto", ".txt"});
      });
  fit.add_option("--residual", options->residual,
                 "A WAV file for what the modes leave of the first strike")
      ->excludes(modes)
      ->check([](const std::string& path) {
        return WhyNotWritten(path, {".wav", ".wave"});
      });
  fit.callback([&program, options] {
    if (options->recordings.empty() && options->modes.empty()) {
      throw CLI::ValidationError("recordings", "give recorded strikes, or --modes");
    }
    for (const auto& other : options->others) {
      if (other.size() < 2) throw CLI::ValidationError("--and", "give a model and its recordings");
    }
    program.command = [&program, options] {
      return FitMaterialTo(*program.Daemon(), *options, program.json);
    };
  });
}

}  // namespace

void AddMaterialFit(CLI::App& material, Program& program) {
  AddExtract(material, program);
  AddFit(material, program);
}

}  // namespace carillon::cli
