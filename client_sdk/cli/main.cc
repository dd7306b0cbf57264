// SPDX-License-Identifier: Apache-2.0
//
// The command line of `carillon`.
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/output.h"
#include "proto/server_address.h"

namespace carillon::cli {
namespace {

/// What all commands share: where the daemon is, how to print, and the one command chosen.
struct Program {
  std::string server = DefaultServerAddress();
  bool json = false;
  std::function<absl::Status()> command;

  std::string admin_token;

  client::Client Daemon() const {
    client::Client daemon(server);
    daemon.SetAdminToken(admin_token);
    return daemon;
  }
};

template <class T>
void AddFigure(CLI::App& app, const std::string& name, std::optional<T>& target,
               const std::string& description) {
  app.add_option(name, target, description)->group("Material");
}

void AddMaterial(CLI::App& app, MaterialFigures& material) {
  app.add_option("--material", material.preset, "a named material; figures given override its own")
      ->group("Material");
  AddFigure(app, "--young", material.young_pa, "Young's modulus, Pa");
  AddFigure(app, "--poisson", material.poisson_ratio, "Poisson's ratio");
  AddFigure(app, "--lame-lambda", material.lame_lambda_pa, "Lame's first constant, Pa");
  AddFigure(app, "--lame-mu", material.lame_mu_pa, "Lame's second constant, Pa");
  AddFigure(app, "--density", material.density_kg_per_m3, "density, kg/m^3");
  AddFigure(app, "--alpha1", material.alpha1_s, "damping proportional to stiffness, s");
  AddFigure(app, "--alpha2", material.alpha2_per_s, "damping proportional to mass, 1/s");
}

void AddStatus(CLI::App& app, Program& program) {
  app.add_subcommand("status", "say what the daemon plays on and what it does")->callback([&] {
    program.command = [&] { return ShowStatus(program.Daemon(), program.server, program.json); };
  });
}

/// "LO:HI" into two frequencies.
CLI::Validator Band(CreateModelOptions& options) {
  return CLI::Validator(
      [&options](std::string& text) -> std::string {
        const size_t colon = text.find(':');
        const bool parsed =
            colon != std::string::npos &&
            CLI::detail::lexical_cast(text.substr(0, colon), options.min_frequency_hz) &&
            CLI::detail::lexical_cast(text.substr(colon + 1), options.max_frequency_hz);
        return parsed ? std::string() : text + " is not two frequencies LO:HI";
      },
      "LO:HI");
}

void AddModelCreate(CLI::App& app, Program& program) {
  auto options = std::make_shared<CreateModelOptions>();
  auto band = std::make_shared<std::string>("20:20000");
  CLI::App& create = *app.add_subcommand("create", "compute the modal model of a mesh file");
  create.add_option("file", options->file, "surface (OBJ, PLY, STL, OFF) or tetrahedra (MSH)")
      ->required();
  create.add_option("--format", options->format, "obj, ply, stl, off or msh [the file's suffix]");
  create.add_option("--label", options->label, "name for people [the file's name]");
  create.add_option("--unit", options->unit, "length unit of the file")
      ->check(CLI::IsMember({"m", "mm", "cm", "in"}))
      ->capture_default_str();
  create.add_option("--element", options->element, "order of the element")
      ->check(CLI::IsMember({"linear", "quadratic"}))
      ->capture_default_str();
  create.add_option("--mass", options->mass, "mass matrix")
      ->check(CLI::IsMember({"lumped", "consistent"}))
      ->capture_default_str();
  create.add_option("--size", options->size,
                    "size it is meant to sound with, relative to the file");
  create.add_option("--band", *band, "frequencies wanted, Hz")
      ->check(Band(*options))
      ->capture_default_str();
  create.add_flag("--keep-surface,!--refine-surface", options->keep_surface,
                  "add no vertices on the surface, or do [decided from the surface]");
  create.add_option("--nodes", options->target_node_count, "about so many corner nodes");
  create
      .add_option("--accuracy", options->accuracy,
                  "so fine a mesh that no mode is off by more, such as 0.01")
      ->check(CLI::PositiveNumber);
  create.add_option("--priority", options->priority, "-100 to 100: higher ones start first");
  create.add_option("--time-limit", options->time_limit_s, "give up after so many seconds");
  create.add_option("--memory-limit-mib", options->memory_limit_mib, "memory that it may take");
  create.add_flag("--repair", options->repair, "mend a surface that is no closed body");
  create
      .add_option("--wall", options->wall_m,
                  "hollow out, or thicken an open sheet, to so many metres")
      ->check(CLI::PositiveNumber);
  create.add_flag("--wait", options->wait, "show the progress and end with the job");
  AddMaterial(create, options->material);
  create.callback([&program, options, band] {
    program.command = [&program, options] {
      return CreateModel(program.Daemon(), *options, program.json);
    };
  });
}

void AddModelShow(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  auto material = std::make_shared<MaterialFigures>();
  CLI::App& show = *app.add_subcommand("show", "show a model; with a material, its frequencies");
  show.add_option("model", *model, "name, label, or first digits of the digest")->required();
  AddMaterial(show, *material);
  show.callback([&program, model, material] {
    program.command = [&program, model, material] {
      return ShowModel(program.Daemon(), *model, *material, program.json);
    };
  });
}

void AddModelDelete(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("delete", "delete a model");
  command.add_option("model", *model, "name, label, or first digits of the digest")->required();
  command.callback([&program, model] {
    program.command = [&program, model] { return DeleteModel(program.Daemon(), *model); };
  });
}

void AddModelList(CLI::App& app, Program& program) {
  auto filter = std::make_shared<v1::ListModalModelsRequest>();
  CLI::App& list = *app.add_subcommand("list", "list the models, newest first");
  list.add_option_function<std::string>(
      "--label", [filter](const std::string& text) { filter->set_label_contains(text); },
      "only those whose label contains this");
  list.add_option_function<std::string>(
      "--tag", [filter](const std::string& text) { filter->set_tag(text); },
      "only those with this tag");
  list.callback([&program, filter] {
    program.command = [&program, filter] {
      return ListModels(program.Daemon(), *filter, program.json);
    };
  });
}

void AddModelTag(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  auto change = std::make_shared<v1::UpdateModalModelRequest>();
  CLI::App& tag = *app.add_subcommand("tag", "label, tag or pin a model");
  tag.add_option("model", *model, "name, label, or first digits of the digest")->required();
  tag.add_option_function<std::string>(
      "--label", [change](const std::string& text) { change->set_label(text); }, "its new label");
  tag.add_option_function<std::vector<std::string>>(
      "--add",
      [change](const std::vector<std::string>& tags) {
        change->mutable_add_tags()->Assign(tags.begin(), tags.end());
      },
      "tags to add");
  tag.add_option_function<std::vector<std::string>>(
      "--remove",
      [change](const std::vector<std::string>& tags) {
        change->mutable_remove_tags()->Assign(tags.begin(), tags.end());
      },
      "tags to take away");
  tag.add_flag_function(
      "--pin,!--unpin", [change](int64_t count) { change->set_pinned(count > 0); },
      "garbage collection leaves it alone, or does not");
  tag.callback([&program, model, change] {
    program.command = [&program, model, change] {
      return UpdateModel(program.Daemon(), *model, *change, program.json);
    };
  });
}

void AddModelExport(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  auto file = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("export", "write a model to a file");
  command.add_option("model", *model, "name, label, or first digits of the digest")->required();
  command.add_option("--out", *file, "where to [its digest, with .model]");
  command.callback([&program, model, file] {
    program.command = [&program, model, file] {
      return ExportModel(program.Daemon(), *model, *file);
    };
  });
}

void AddModelImport(CLI::App& app, Program& program) {
  auto file = std::make_shared<std::string>();
  auto label = std::make_shared<std::string>();
  CLI::App& command = *app.add_subcommand("import", "store the model of a file");
  command.add_option("file", *file, "written by export or by carillon-precompute")->required();
  command.add_option("--label", *label, "name for people");
  command.callback([&program, file, label] {
    program.command = [&program, file, label] {
      return ImportModel(program.Daemon(), *file, *label, program.json);
    };
  });
}

void AddModel(CLI::App& app, Program& program) {
  CLI::App& model = *app.add_subcommand("model", "modal models")->require_subcommand(1);
  AddModelCreate(model, program);
  AddModelList(model, program);
  AddModelShow(model, program);
  AddModelDelete(model, program);
  AddModelTag(model, program);
  AddModelExport(model, program);
  AddModelImport(model, program);
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
