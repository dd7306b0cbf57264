// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/value_options.h"

namespace carillon::cli {
namespace {

/// Adds a flag that sets `target`, which is absent without it, to `value`.
CLI::Option* AddSwitch(CLI::App& app, const std::string& name, const std::string& text,
                       std::optional<bool>& target, bool value = true) {
  return app.add_flag_callback(
      "--" + name, [&target, value] { target = value; }, text);
}

}  // namespace

void AddConsole(CLI::App& app, Program& program) {
  auto options = std::make_shared<ConsoleOptions>();
  CLI::App& console = *app.add_subcommand(
      "console", "See, strike and hear bodies in a browser; starts the daemon if none runs");
  console.add_option("--port", options->port, "The port of 127.0.0.1 to listen at; 0 takes any")
      ->capture_default_str();
  console.add_flag("--browser,!--no-browser", options->browser,
                   "Open a browser where there is a desktop [yes]");
  console.callback([&program, options] {
    program.command = [&program, options] {
      const StopSignal stop;
      return RunConsole(program, *options, stop);
    };
  });
}

void AddVolume(CLI::App& app, Program& program) {
  auto options = std::make_shared<VolumeOptions>();
  CLI::App& volume =
      *app.add_subcommand("volume", "Show or change how loud the daemon or one of its scenes is");
  CLI::Option* const scene = volume.add_option("--scene", options->scene,
                                               "The name or the number of a scene [the output]");
  ReadGain(*volume.add_option("gain,--gain", options->gain, absl::StrCat("The gain: ", kGainForm)));
  AddSwitch(volume, "mute", "Silence it", options->muted);
  AddSwitch(volume, "unmute", "End that", options->muted, false)->excludes("--mute");
  AddSwitch(volume, "solo", "Let only this scene, and others with this flag, sound of your scenes",
            options->solo)
      ->needs(scene);
  AddSwitch(volume, "no-solo", "End that", options->solo, false)->needs(scene)->excludes("--solo");
  SetRun(volume, program, [options](const client::Client& daemon, bool json) {
    return ChangeVolume(daemon, *options, json);
  });
}

void AddStop(CLI::App& app, Program& program) {
  auto scene = std::make_shared<std::string>();
  CLI::App& stop = *app.add_subcommand("stop", "Silence all that sounds, with a short fade");
  stop.add_option("scene", *scene, "The name or the number of a scene [all of your scenes]");
  SetRun(stop, program, [scene](const client::Client& daemon, bool json) {
    return StopSound(daemon, *scene, json);
  });
}

void AddSceneRecord(CLI::App& scene, Program& program) {
  auto name = std::make_shared<std::string>();
  auto out = std::make_shared<std::string>();
  CLI::App& record = *scene.add_subcommand(
      "record", "Record the next contact stream of a scene for `carillon render`");
  record.add_option("scene", *name, "The name or the number of a scene")->required();
  record.add_option("--out", *out, "The contact trace to write (.contacts)")->required();
  record.callback([&program, name, out] {
    program.command = [&program, name, out] {
      const StopSignal stop;
      return RecordContacts(*program.Daemon(), *name, *out, stop);
    };
  });
}

}  // namespace carillon::cli
