// SPDX-License-Identifier: Apache-2.0
//
// The command line of `carillon`.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/material_options.h"
#include "client_sdk/cli/model_options.h"
#include "client_sdk/cli/output.h"
#include "client_sdk/cli/program.h"

namespace carillon::cli {
namespace {

void AddStatus(CLI::App& app, Program& program) {
  app.add_subcommand("status", "say what the daemon plays on and what it does")->callback([&] {
    program.command = [&] { return ShowStatus(program.Daemon(), program.server, program.json); };
  });
}

void AddDatabase(CLI::App& app, Program& program) {
  auto file = std::make_shared<std::string>();
  auto budget_mib = std::make_shared<uint64_t>(0);
  CLI::App& db = *app.add_subcommand("db", "the daemon's database, for administrators");
  db.require_subcommand(1);
  db.add_option("--token", program.admin_token, "an administrator's token, over TCP")
      ->envname("CARILLON_ADMIN_TOKEN");
  db.add_subcommand("stats", "say what it holds")->callback([&program] {
    program.command = [&program] { return ShowDatabaseStats(program.Daemon(), program.json); };
  });
  CLI::App& backup = *db.add_subcommand("backup", "write a copy of it to a file");
  backup.add_option("file", *file, "where to")->required();
  backup.callback([&program, file] {
    program.command = [&program, file] { return program.Daemon().BackUpDatabase(*file); };
  });
  CLI::App& collect = *db.add_subcommand("collect", "delete models, least recently sounded first");
  collect.add_option("--budget-mib", *budget_mib, "what those left may take")->required();
  collect.callback([&program, budget_mib] {
    program.command = [&program, budget_mib] {
      return CollectGarbage(program.Daemon(), *budget_mib, program.json);
    };
  });
}

void AddJob(CLI::App& app, Program& program) {
  auto name = std::make_shared<std::string>();
  CLI::App& job = *app.add_subcommand("job", "decomposition jobs")->require_subcommand(1);
  CLI::App& watch = *job.add_subcommand("watch", "follow a job to its end");
  watch.add_option("job", *name, "name, label, or first digits of the digest")->required();
  watch.callback([&program, name] {
    program.command = [&program, name] { return WatchJob(program.Daemon(), *name, program.json); };
  });
  auto options = std::make_shared<RunJobOptions>();
  CLI::App& run = *job.add_subcommand(
      "run", "decompose for the daemon on another machine: what its batch jobs call");
  run.add_option("digest", options->digest, "of the job")->required();
  run.add_option("command", options->command, "reads the file mesh, writes the file model")
      ->required();
  run.add_option("--token", options->token, "of this run [$CARILLON_JOB_TOKEN]")
      ->envname("CARILLON_JOB_TOKEN")
      ->required();
  run.callback([&program, options] {
    program.command = [&program, options] {
      const StopSignal stop;
      return RunJob(program.Daemon(), *options, stop);
    };
  });
}

void AddStrike(CLI::App& app, Program& program) {
  auto options = std::make_shared<StrikeOptions>();
  CLI::App& strike = *app.add_subcommand("strike", "strike a model once and let it ring");
  strike.add_option("model", options->model, "name, label, or first digits of the digest")
      ->required();
  strike.add_option("--point", options->point_m, "where: x,y,z in the object's frame, m")
      ->delimiter(',')
      ->required();
  strike.add_option("--impulse", options->impulse_newton_seconds, "how hard: x,y,z, N s")
      ->delimiter(',')
      ->required();
  strike.add_option("--duration", options->duration_s, "how long the contact lasts, s");
  strike.add_option("--size", options->size, "size relative to the model's");
  strike.add_option("--gain", options->gain, "linear gain");
  strike.add_option("--seconds", options->seconds,
                    "how long to let it ring [until it is 60 dB down]");
  AddMaterial(strike, options->material);
  strike.callback([&program, options] {
    program.command = [&program, options] {
      const StopSignal stop;
      return Strike(program.Daemon(), *options, stop, program.json);
    };
  });
}

void AddListen(CLI::App& app, Program& program) {
  auto options = std::make_shared<ListenOptions>();
  CLI::App& listen = *app.add_subcommand("listen", "hear what the daemon plays");
  listen.add_option("--out", options->out, "WAV file [raw 32-bit float samples to stdout]");
  listen.add_option("--seconds", options->seconds, "how long [until stopped]")
      ->check(CLI::NonNegativeNumber);
  listen.callback([&program, options] {
    program.command = [&program, options] {
      const StopSignal stop;
      return Listen(program.Daemon(), *options, stop);
    };
  });
}

void AddRender(CLI::App& app, Program& program) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App& render = *app.add_subcommand("render", "render a contact trace to a WAV file");
  render.add_option("trace", options->trace, "contact trace (.contacts)")->required();
  render.add_option("--out", options->out, "WAV file")->required();
  render.add_option("--sample-rate", options->sample_rate_hz, "frames a second")
      ->capture_default_str();
  render.add_option("--channels", options->channel_count, "1: mono, 2: stereo")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  render.add_option("--tail", options->tail_s,
                    "seconds after the last contact [until it is silent]");
  render.callback([&program, options] {
    program.command = [&program, options] {
      return Render(program.Daemon(), *options, program.json);
    };
  });
}

int Main(int argc, char** argv) {
  Program program;
  CLI::App app("Makes rigid-body simulations audible: talks to the daemon carillond.", "carillon");
  app.add_option("--server", program.server, "unix:PATH or HOST:PORT [$CARILLON_SERVER]")
      ->capture_default_str();
  app.add_option("--tls-roots", program.tls_roots_file,
                 "PEM file that vouches for a daemon with TLS [$CARILLON_TLS_ROOTS]")
      ->envname("CARILLON_TLS_ROOTS")
      ->check(CLI::ExistingFile);
  app.add_flag("--json", program.json, "print results as JSON");
  app.require_subcommand(1)->fallthrough();
  app.footer(
      "Exits with 0 when done, 1 when refused (stderr says why), 2 when called wrongly, 3 "
      "when no daemon answers.");
  AddStatus(app, program);
  AddDatabase(app, program);
  AddModel(app, program);
  AddJob(app, program);
  AddStrike(app, program);
  AddListen(app, program);
  AddRender(app, program);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  return Report(program.command());
}

}  // namespace
}  // namespace carillon::cli

int main(int argc, char** argv) { return carillon::cli::Main(argc, argv); }
