// SPDX-License-Identifier: Apache-2.0
//
// The command line of `carillon`.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/doctor_command.h"
#include "client_sdk/cli/commands/program.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/unknown_word.h"
#include "client_sdk/cli/options/value_options.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/striker_catalogue.h"

namespace carillon::cli {
namespace {

void AddStatus(CLI::App& app, Program& program) {
  app.add_subcommand("status",
                     "Show the audio device, the mixer, the load and the limits of the daemon")
      ->callback([&] {
        program.command = [&] {
          return ShowStatus(*program.Daemon(), program.server, program.json);
        };
      });
}

void AddCollect(CLI::App& db, Program& program) {
  auto budget_mib = std::make_shared<uint64_t>(0);
  CLI::App& collect =
      *db.add_subcommand("collect", "Delete the models that sounded least recently");
  auto delete_unpinned = std::make_shared<bool>(false);
  auto unused_meshes = std::make_shared<bool>(false);
  auto dry_run = std::make_shared<bool>(false);
  CLI::Option_group& budget = *collect.add_option_group("budget");
  budget
      .add_option("--budget-mib", *budget_mib, "The size that the remaining models may have, MiB")
      ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 40U));
  budget.add_flag("--delete-unpinned", *delete_unpinned,
                  "Delete every model that is neither pinned nor sounding");
  budget.add_flag("--unused-meshes", *unused_meshes,
                  "Delete only the meshes that no model and no job refers to");
  budget.require_option(1);
  collect.add_flag("--dry-run", *dry_run, "Only say what would be deleted");
  SetRun(collect, program,
         [budget_mib, delete_unpinned, unused_meshes, dry_run](const client::Client& daemon,
                                                               bool json) {
           v1::CollectGarbageRequest request;
           request.set_budget_bytes(*budget_mib << 20U);
           request.set_delete_unpinned(*delete_unpinned);
           request.set_delete_unused_meshes(*unused_meshes);
           request.set_dry_run(*dry_run);
           return CollectGarbage(daemon, request, json);
         });
}

void AddDatabase(CLI::App& app, Program& program) {
  auto file = std::make_shared<std::string>();
  CLI::App& db =
      *app.add_subcommand("db", "Look after the database of the daemon (for administrators)");
  db.require_subcommand(1);
  SetRun(*db.add_subcommand("stats", "Show the number and the size of models, meshes and jobs"),
         program, ShowDatabaseStats);
  CLI::App& backup = *db.add_subcommand("backup", "Write a copy of the database to a file");
  backup.add_option("file", *file, "The file to write")->required();
  SetRun(backup, program, [file](const client::Client& daemon, bool json) {
    return BackUpDatabase(daemon, *file, json);
  });
  AddCollect(db, program);
}

void AddTransfer(CLI::App& app, Program& program) {
  auto options = std::make_shared<CreateTransferOptions>();
  CLI::App& create = *app.add_subcommand(
      "transfer", "Compute the radiation of a stored model for a material, and store it");
  create.add_option("model", options->model, kModelName)->required();
  TakeSize(*create.add_option("--size", options->size, "The size relative to that of the model"));
  TakeWithin(*create.add_option("--accuracy", options->accuracy_db,
                                "The error of each mode's power that is small enough, dB [2]"),
             0.06, 20, "leave it out for 2 dB");
  TakeWithin(*create.add_option("--budget", options->budget_s,
                                "The processor time to spend, s [by the size of the model]"),
             0.001, 1e9, "leave it out for a time by the size of the model, 20 to 600 s");
  create.add_flag("--wait,!--no-wait", options->wait, "Wait until it is stored [no]");
  AddMaterial(create, options->material);
  SetRun(create, program, [options](const client::Client& daemon, bool json) {
    return CreateTransfer(daemon, *options, json);
  });
}

void AddDoctor(CLI::App& app, Program& program) {
  SetRun(*app.add_subcommand("doctor", "Check the health of the daemon, and say what to do"),
         program, Diagnose);
}

/// Adds the options of the object that is struck.
void AddStruckObject(CLI::App& strike, StrikeOptions& options) {
  TakeSize(*strike.add_option("--size", options.size, "The size relative to that of the model"));
  ReadGain(*strike.add_option("--gain", options.gain, absl::StrCat("The gain: ", kGainForm)));
  CLI::Option* paper = strike.add_flag("--paper-coupling", options.paper_coupling,
                                       "Sound by the paper's coupling though a transfer is stored");
  strike
      .add_flag("--modes-only", options.modes_only,
                "Sound by the stored transfer without the click of the body's acceleration")
      ->excludes(paper);
}

/// Adds the options of the file that a strike is written to.
void AddStrikeFile(CLI::App& strike, StrikeOptions& options) {
  CLI::Option* const out =
      strike
          .add_option("--out", options.out,
                      "Write a WAV file, as `carillon render` does, and play nothing")
          ->check([](const std::string& path) {
            return WhyNotWritten(path, {".wav", ".wave"});
          });
  strike
      .add_flag("--normalize", options.normalize,
                "Scale the sound of the file to a peak of 0.9 of full scale")
      ->needs(out);
}

/// Throws a CLI::ValidationError if the impulse is zero, because the strike would be silent.
void CheckImpulse(const std::array<double, 3>& impulse) {
  if (impulse != std::array<double, 3>{}) return;
  throw CLI::ValidationError(
      "--impulse", "a strike with an impulse of 0,0,0 is silent; give N s, such as 0,0,-0.01");
}

void AddStrike(CLI::App& app, Program& program) {
  auto options = std::make_shared<StrikeOptions>();
  CLI::App& strike = *app.add_subcommand("strike", "Strike a model once and let it ring");
  strike.add_option("model", options->model, kModelName)->required();
  strike
      .add_option("--point", options->point_m,
                  "The struck point: X,Y,Z or X Y Z in the frame of the object, m")
      ->delimiter(',')
      ->required();
  strike
      .add_option("--impulse", options->impulse_newton_seconds,
                  "The impulse on the object: X,Y,Z or X Y Z in its frame, N s")
      ->delimiter(',')
      ->required();
  CLI::Option* striker =
      strike
          .add_option("--striker", options->striker, absl::StrCat("What strikes: ", StrikerNames()))
          ->default_str("steel");
  strike
      .add_option("--duration", options->duration_s,
                  "The duration of the contact, s [that of an elastic collision with the striker]")
      ->excludes(striker);
  AddStruckObject(strike, *options);
  TakeWithin(
      *strike.add_option("--seconds", options->seconds,
                         "The time to ring, s [until the sound is 60 dB below its peak, at most "
                         "30 s, and 60 s in a file]"),
      0.001, 1e9, "leave --seconds out to hear the sound until it has decayed");
  AddMaterial(strike, options->material);
  AddStrikeFile(strike, *options);
  strike.callback([&program, options] {
    CheckImpulse(options->impulse_newton_seconds);
    CheckJson(program, options->out);
    program.command = [&program, options] {
      const StopSignal stop;
      return Strike(*program.Daemon(), *options, stop, program.json);
    };
  });
}

void AddListen(CLI::App& app, Program& program) {
  auto options = std::make_shared<ListenOptions>();
  CLI::App& listen = *app.add_subcommand("listen", "Record the sound that the daemon plays");
  listen
      .add_option("--out", options->out,
                  "The WAV file to write [raw 32-bit float samples to stdout]")
      ->check([](const std::string& path) {
        return WhyNotWritten(path, {".wav", ".wave"});
      });
  TakeWithin(*listen.add_option("--seconds", options->seconds,
                                "The time to record, s [until the program is stopped]"),
             0.001, 1e9, "leave --seconds out to record until the program is stopped");
  listen.add_option("--scene", options->scene,
                    "The name or the number of a scene to record alone [the output]");
  listen.add_flag("--quiet", options->quiet, "Show no level on the terminal");
  listen.callback([&program, options] {
    CheckJson(program, options->out.empty() ? "-" : options->out);
    if (options->out.empty() && isatty(STDOUT_FILENO) != 0) {
      throw CLI::ValidationError("--out",
                                 "a terminal shows no raw samples: give a .wav file, or "
                                 "pipe them to another program");
    }
    program.command = [&program, options] {
      const StopSignal stop;
      return Listen(*program.Daemon(), *options, stop, program.json);
    };
  });
}

void AddProgramOptions(CLI::App& app, Program& program) {
  app.add_option("--server", program.server,
                 "The address of the daemon: unix:PATH or HOST:PORT [$CARILLON_SERVER]")
      ->capture_default_str();
  app.add_option("--tls-roots", program.tls_roots_file,
                 "The PEM file with the certificates that vouch for a daemon with TLS "
                 "[$CARILLON_TLS_ROOTS]")
      ->envname("CARILLON_TLS_ROOTS")
      ->check(CLI::ExistingFile);
  app.add_option("--tls-certificate", program.tls_certificate_file,
                 "The PEM file with the certificate by which the daemon knows you "
                 "[$CARILLON_TLS_CERTIFICATE]")
      ->envname("CARILLON_TLS_CERTIFICATE")
      ->check(CLI::ExistingFile);
  app.add_option("--tls-key", program.tls_key_file,
                 "The PEM file with the private key of that certificate [$CARILLON_TLS_KEY]")
      ->envname("CARILLON_TLS_KEY")
      ->check(CLI::ExistingFile);
  app.add_option("--token", program.token,
                 "The token by which the daemon knows you over TCP [$CARILLON_TOKEN]")
      ->envname("CARILLON_TOKEN");
  app.add_option("--token-file", program.token_file,
                 "The file whose first line is that token [$CARILLON_TOKEN_FILE]")
      ->envname("CARILLON_TOKEN_FILE")
      ->check(CLI::ExistingFile);
  app.add_flag("--json", program.json, "Print the results as JSON");
  app.set_version_flag("--version", "carillon " CARILLON_VERSION);
  app.set_help_all_flag("--help-all", "Print the help of all commands and exit");
  app.require_subcommand(1)->fallthrough();
  app.footer(
      "Exit codes: 0 for success; 1 if the command fails, and stderr says why; 2 if the "
      "command line is wrong; 3 if no daemon answers.");
}

void AddCommands(CLI::App& app, Program& program) {
  AddStatus(app, program);
  AddDoctor(app, program);
  AddDatabase(app, program);
  AddModel(app, program);
  AddTransfer(app, program);
  AddJob(app, program);
  AddMaterials(app, program);
  AddExplain(app, program);
  AddScenes(app, program);
  AddStrike(app, program);
  AddListen(app, program);
  AddConsole(app, program);
  AddRender(app, program);
  AddFoley(app, program);
  AddVolume(app, program);
  AddStop(app, program);
  AddExample(app, program);
}

/// Returns the option of this name that the program has, or the command that the command line
/// chose. Returns null if neither has it.
const CLI::Option* FindOption(const CLI::App& app, const std::string& name) {
  if (const CLI::Option* option = app.get_option_no_throw(name)) return option;
  const std::vector<const CLI::App*> chosen =
      app.get_subcommands([](const CLI::App* command) { return command->count() > 0; });
  return chosen.empty() ? nullptr : FindOption(*chosen.front(), name);
}

/// Returns the text of a usage error, which says of a value that its option cannot read what the
/// option takes.
std::string MistakeText(const CLI::App& app, const CLI::ParseError& error) {
  const std::string help = "\nRun with --help for more information.";
  absl::string_view text = error.what();
  const bool is_value = absl::ConsumePrefix(&text, "Could not convert: ");
  const std::vector<std::string> parts = absl::StrSplit(text, absl::MaxSplits(" = ", 1));
  const CLI::Option* option = is_value && parts.size() == 2 ? FindOption(app, parts[0]) : nullptr;
  if (option == nullptr) return absl::StrCat(error.what(), help);
  // A vector with too few numbers takes the next option for one.
  const std::string given = parts[1].substr(0, parts[1].find(",--"));
  return absl::StrCat(parts[0], " cannot be ", given, ": ", option->get_description(), help);
}

/// Prints a usage error to stderr, and with --json its first line to stdout as an error object.
/// Returns the exit code.
int ReportMistake(const std::string& what, int argc, char** argv) {
  std::cerr << "carillon: " << what << '\n';
  const auto is_json = [](absl::string_view word) { return word == "--json"; };
  if (std::any_of(argv, argv + argc, is_json)) {
    std::cout << ErrorJson(Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                                   what.substr(0, what.find('\n'))))
              << '\n';
  }
  return kUsage;
}

/// Returns the exit code of a command that ended with `code`, once its output is written.
int Finish(int code) { return code == kDone ? Report(FlushOutput()) : code; }

int Main(int argc, char** argv) {
  Program program;
  CLI::App app("Controls the daemon carillond, which makes rigid-body simulations audible.",
               "carillon");
  AddProgramOptions(app, program);
  AddCommands(app, program);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string unknown = UnknownWord(app, argc, argv);
    if (error.get_exit_code() == 0 && unknown.empty()) return Finish(app.exit(error));
    return ReportMistake(unknown.empty() ? MistakeText(app, error) : unknown, argc, argv);
  }
  if (!IsServerAddress(program.server)) {
    return ReportMistake(
        absl::StrCat("--server or $CARILLON_SERVER: \"", program.server,
                     "\" must be unix:PATH, or HOST:PORT with a port from 1 to 65535"),
        argc, argv);
  }
  return Finish(Report(program.command(), program.json));
}

}  // namespace
}  // namespace carillon::cli

int main(int argc, char** argv) { return carillon::cli::Main(argc, argv); }
