// SPDX-License-Identifier: Apache-2.0
//
// The command line of `carillon model`.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/quantity.h"
#include "client_sdk/cli/options/value_options.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/program/parsed_option.h"
#include "proto/cpp/program/settings_options.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// Parses "LO:HI" as two frequencies, and "HI" as the higher one. HI of zero is the default.
CLI::Validator Band(CreateModelOptions& options) {
  return CLI::Validator(
      [&options](std::string& text) -> std::string {
        const size_t colon = text.find(':');
        const bool has_low = colon != std::string::npos;
        const std::string high = has_low ? text.substr(colon + 1) : text;
        const bool parsed = (!has_low || CLI::detail::lexical_cast(text.substr(0, colon),
                                                                   options.min_frequency_hz)) &&
                            CLI::detail::lexical_cast(high, options.max_frequency_hz) &&
                            options.max_frequency_hz >= (has_low ? options.min_frequency_hz : 0);
        return parsed ? std::string() : text + " is not two frequencies LO:HI, or the higher one";
      },
      "LO:HI|HI");
}

void AddBand(CLI::App& create, const std::shared_ptr<CreateModelOptions>& options) {
  create
      .add_option_function<std::string>(
          "--band", [options](const std::string& /*checked*/) {},
          "frequencies wanted, Hz [20:20000; fewer modes where those are too many for 7 GiB or a "
          "minute]")
      ->check(Band(*options));
}

void AddModelCreate(CLI::App& app, Program& program) {
  auto options = std::make_shared<CreateModelOptions>();
  CLI::App& create = *app.add_subcommand("create", "Compute the modal model of a mesh file");
  create
      .add_option(
          "file", options->files,
          "surfaces (OBJ, PLY, STL, OFF, glTF) or tetrahedra (Gmsh MSH, Medit, TetGen, Abaqus or "
          "CalculiX INP)")
      ->required();
  create.add_option("--format", options->format,
                    absl::StrCat(MeshFormatNames(), " [the file's suffix]"));
  create.add_option("--label", options->label, "name for people of a single file [its name]");
  TakeSize(*create.add_option("--size", options->size,
                              "size it is meant to sound with, relative to the file"));
  AddBand(create, options);
  create.add_flag("--without-transfer", options->without_transfer,
                  "Do not compute how the modes radiate afterwards");
  create.add_flag("--coarse-first", options->coarse_first,
                  "first a model of few nodes, under the same name, to sound with meanwhile");
  create.add_option("--priority", options->priority, "-100 to 100: higher ones start first");
  create.add_option("--time-limit", options->time_limit_s, "give up after this many seconds");
  create.add_option("--memory-limit-mib", options->memory_limit_mib, "memory that it may take")
      ->check(CLI::Range(uint64_t{0}, uint64_t{1} << 40U));
  options->wait = isatty(STDERR_FILENO) != 0;
  create.add_flag("--wait,!--no-wait", options->wait,
                  "show the progress and end with the jobs [on a terminal]");
  create.add_option(
      "--report", options->report,
      "a file that gets a line of JSON for each mesh file: its model, frequencies, T60 "
      "and warnings, or its error; implies --wait");
  create.add_flag("--may-repair,!--no-repair", options->may_repair,
                  "with --wait, repair a surface that is refused otherwise, and say so [yes]");
  AddMaterial(create, options->material);
  AddSettingsOptions(create, options->settings);
  create.callback([&program, &create, options] {
    if (!options->report.empty() && create.count("--wait") == 0) options->wait = true;
    if (options->files.size() > 1 && !options->label.empty()) {
      throw CLI::ValidationError("--label", "several files would get the same label");
    }
    program.command = [&program, options] {
      return CreateModel(*program.Daemon(), *options, program.json);
    };
  });
}

void AddModelShow(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  auto material = std::make_shared<MaterialFigures>();
  CLI::App& show = *app.add_subcommand(
      "show", "Show a model and, with a material, its frequencies and decay rates");
  show.add_option("model", *model, kModelName)->required();
  AddMaterial(show, *material);
  SetRun(show, program, [model, material](const client::Client& daemon, bool json) {
    return ShowModel(daemon, *model, *material, json);
  });
}

void AddModelDelete(CLI::App& app, Program& program) {
  auto models = std::make_shared<std::vector<std::string>>();
  CLI::App& command = *app.add_subcommand("delete", "Delete models");
  command.add_option("model", *models, kModelName)->required();
  SetRun(command, program, [models](const client::Client& daemon, bool json) {
    return DeleteModels(daemon, *models, json);
  });
}

/// A number of MiB as bytes.
uint64_t Bytes(double mib) { return static_cast<uint64_t>(std::llround(mib * (1 << 20))); }

void AddSizes(CLI::App& list, const std::shared_ptr<v1::ListModalModelsRequest>& filter) {
  constexpr double kMostMib = 1 << 30;
  list.add_option_function<double>(
          "--min-mib", [filter](double mib) { filter->set_min_stored_bytes(Bytes(mib)); },
          "List only models of at least this size, MiB")
      ->check(CLI::Range(0.0, kMostMib));
  list.add_option_function<double>(
          "--max-mib",
          // Zero would be no limit.
          [filter](double mib) { filter->set_max_stored_bytes(std::max<uint64_t>(1, Bytes(mib))); },
          "List only models of at most this size, MiB")
      ->check(CLI::Range(0.0, kMostMib));
}

void AddTimes(CLI::App& list, const std::shared_ptr<v1::ListModalModelsRequest>& filter) {
  const std::string form = "a date, or a date and a time, such as 2026-11-21 or 2026-11-21T14:30";
  AddParsed(list, "--since", ParseTimeUnixMs, form, "List only models stored at or after this time",
            [filter](int64_t ms) { filter->set_created_since_unix_ms(ms); });
  AddParsed(list, "--before", ParseTimeUnixMs, form, "List only models stored before this time",
            [filter](int64_t ms) { filter->set_created_before_unix_ms(ms); });
}

void AddModelList(CLI::App& app, Program& program) {
  auto filter = std::make_shared<v1::ListModalModelsRequest>();
  CLI::App& list = *app.add_subcommand("list", "List the models, newest first");
  list.add_option_function<std::string>(
      "--label", [filter](const std::string& text) { filter->set_label_contains(text); },
      "List only models whose label contains this text, in upper or lower case");
  list.add_option_function<std::string>(
      "--tag", [filter](const std::string& text) { filter->set_tag(text); },
      "List only models with this tag");
  AddSizes(list, filter);
  AddTimes(list, filter);
  list.add_option_function<int>(
          "--page-size", [filter](int count) { filter->set_page_size(count); },
          "List at most this many models, and print the token of the next page [all]")
      ->check(CLI::Range(1, 1000));
  list.add_option_function<std::string>(
          "--page-token", [filter](const std::string& token) { filter->set_page_token(token); },
          "List the page with this token")
      ->needs("--page-size");
  SetRun(list, program, [filter](const client::Client& daemon, bool json) {
    return ListModels(daemon, *filter, json);
  });
}

void AddModelTag(CLI::App& app, Program& program) {
  auto model = std::make_shared<std::string>();
  auto change = std::make_shared<v1::UpdateModalModelRequest>();
  auto material = std::make_shared<MaterialFigures>();  // of objects that name none
  CLI::App& tag = *app.add_subcommand("tag", "Label, tag or pin a model, or set its material");
  tag.add_option("model", *model, kModelName)->required();
  tag.add_option_function<std::string>(
      "--label", [change](const std::string& text) { change->set_label(text); }, "The new label");
  tag.add_option_function<std::vector<std::string>>(
      "--add",
      [change](const std::vector<std::string>& tags) {
        change->mutable_add_tags()->Assign(tags.begin(), tags.end());
      },
      "The tags to add");
  tag.add_option_function<std::vector<std::string>>(
      "--remove",
      [change](const std::vector<std::string>& tags) {
        change->mutable_remove_tags()->Assign(tags.begin(), tags.end());
      },
      "The tags to remove");
  tag.add_flag_function(
      "--pin,!--unpin", [change](int64_t count) { change->set_pinned(count > 0); },
      "Keep the model from garbage collection, or no longer");
  AddMaterial(tag, *material);
  SetRun(tag, program, [model, change, material](const client::Client& daemon, bool json) {
    ASSIGN_OR_RETURN(const v1::Material objects, ToMaterial(*material));
    if (objects.ByteSizeLong() > 0) *change->mutable_material() = objects;
    return UpdateModel(daemon, *model, *change, json);
  });
}

/// Adds the option for the format of a model file.
void AddFileFormat(CLI::App& app, std::string& format) {
  app.add_option("--format", format, "The format of the file [by its suffix, otherwise model]")
      ->check(CLI::IsMember({"model", "glb", "gltf", "npz"}));
}

void AddModelExport(CLI::App& app, Program& program) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App& command = *app.add_subcommand(
      "export", "Write a model to a file in its stored form, as glTF, or for NumPy");
  command.add_option("model", options->model, kModelName)->required();
  command.add_option("--out", options->file,
                     "The file to write: .model, .glb, .gltf or .npz [the digest with .model]");
  AddFileFormat(command, options->format);
  AddMaterial(command, options->material);
  command.callback([&program, options] {
    const std::string wrong = WhyNotWritten(options->file, {".model", ".glb", ".gltf", ".npz"});
    if (options->format.empty() && !wrong.empty()) throw CLI::ValidationError("--out", wrong);
    program.command = [&program, options] {
      return ExportModel(*program.Daemon(), *options, program.json);
    };
  });
}

void AddModelImport(CLI::App& app, Program& program) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App& command = *app.add_subcommand("import", "Store the model of a file");
  command
      .add_option("file", options->file,
                  "A file of export or carillon-precompute, a glTF with modal models, or a .npz")
      ->required();
  AddFileFormat(command, options->format);
  command.add_option("--label", options->label,
                     "The label [the name in a glTF, or that of the file]");
  command.add_option(
      "--pick", options->pick,
      "A model of a glTF that has several: its name or number, or the name of a node");
  AddMaterial(command, options->material);
  SetRun(command, program, [options](const client::Client& daemon, bool json) {
    return ImportModel(daemon, *options, json);
  });
}

void AddModelTune(CLI::App& app, Program& program) {
  auto options = std::make_shared<TuneOptions>();
  CLI::App& command = *app.add_subcommand(
      "tune", "Find the size, or the length along one axis, that gives a mode its pitch");
  command.add_option("model", options->model, kModelName)->required();
  AddParsed(command, "--to", ParsePitch, "a note such as A4, C#5 or Bb3, or Hz",
            "The pitch: a note (A4 is 440 Hz), or Hz",
            [options](double hz) { options->to_hz = hz; })
      ->required();
  command.add_option("--mode", options->mode,
                     "The mode, counted from 1 as model show lists them [1]");
  command
      .add_option("--by", options->by,
                  "What is changed: the size of the whole body, its length or thickness (the axis "
                  "of its file that is longest or shortest), or the axis x, y or z [size]")
      ->check(CLI::IsMember({"size", "length", "thickness", "x", "y", "z"}).description(""));
  AddMaterial(command, options->material);
  SetRun(command, program, [options](const client::Client& daemon, bool json) {
    return TuneModel(daemon, *options, json);
  });
}

}  // namespace

void AddModel(CLI::App& app, Program& program) {
  CLI::App& model =
      *app.add_subcommand("model", "Create, list and move modal models")->require_subcommand(1);
  AddModelCreate(model, program);
  AddModelList(model, program);
  AddModelShow(model, program);
  AddModelDelete(model, program);
  AddModelTag(model, program);
  AddModelExport(model, program);
  AddModelImport(model, program);
  AddModelTune(model, program);
}

}  // namespace carillon::cli
