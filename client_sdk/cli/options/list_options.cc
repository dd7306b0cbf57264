// SPDX-License-Identifier: Apache-2.0
//
// The command lines of `carillon job`, `carillon material`, `carillon explain`, `carillon scene`
// and `carillon example`.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/value_options.h"

namespace carillon::cli {
namespace {

/// Adds a command about one thing, which `description` says how to name.
void AddAbout(CLI::App& parent, Program& program, const std::string& name, const std::string& text,
              const std::string& description,
              absl::Status (*run)(const client::Client&, const std::string&, bool)) {
  auto thing = std::make_shared<std::string>();
  CLI::App& command = *parent.add_subcommand(name, text);
  command.add_option(parent.get_name(), *thing, description)->required();
  SetRun(command, program, [run, thing](const client::Client& daemon, bool json) {
    return run(daemon, *thing, json);
  });
}

/// The options that choose jobs by state and label.
struct JobChoice {
  std::vector<std::string> states;
  std::string label;
};

void AddJobChoice(CLI::App& command, JobChoice& choice) {
  command
      .add_option("--state", choice.states,
                  "Only jobs in these states: waiting, running, done, failed, cancelled [any]")
      ->delimiter(',')
      ->transform(CLI::IsMember(
                      {"waiting", "queued", "running", "done", "succeeded", "failed", "cancelled"},
                      CLI::ignore_case)
                      .description(""));
  command.add_option("--label", choice.label, "Only jobs whose label contains this text");
}

/// The state with a name that AddJobChoice allows.
v1::JobState StateOf(const std::string& name) {
  if (name == "waiting" || name == "queued") return v1::JOB_STATE_QUEUED;
  if (name == "running") return v1::JOB_STATE_RUNNING;
  if (name == "failed") return v1::JOB_STATE_FAILED;
  return name == "cancelled" ? v1::JOB_STATE_CANCELLED : v1::JOB_STATE_SUCCEEDED;
}

/// The request for the chosen jobs: a ListJobsRequest or a WatchJobsRequest.
template <class Request>
Request RequestOf(const JobChoice& choice) {
  Request request;
  for (const std::string& state : choice.states) request.add_states(StateOf(state));
  request.set_label_contains(choice.label);
  return request;
}

void AddJobList(CLI::App& job, Program& program) {
  auto choice = std::make_shared<JobChoice>();
  CLI::App& list = *job.add_subcommand("list", "List the jobs, newest first");
  AddJobChoice(list, *choice);
  SetRun(list, program, [choice](const client::Client& daemon, bool json) {
    return ListJobs(daemon, RequestOf<v1::ListJobsRequest>(*choice), json);
  });
}

void AddJobWatch(CLI::App& job, const std::string& named, Program& program) {
  auto text = std::make_shared<std::string>();
  auto choice = std::make_shared<JobChoice>();
  CLI::App& watch = *job.add_subcommand(
      "watch", "Show the progress of a job until it ends, or the changes of all jobs");
  watch.add_option("job", *text, named + " [all jobs, until the program is stopped]");
  AddJobChoice(watch, *choice);
  SetRun(watch, program, [text, choice](const client::Client& daemon, bool json) {
    if (!text->empty()) return WatchJob(daemon, *text, json);
    return WatchJobs(daemon, RequestOf<v1::WatchJobsRequest>(*choice), json);
  });
}

}  // namespace

void AddJob(CLI::App& app, Program& program) {
  CLI::App& job = *app.add_subcommand("job", "List, follow, cancel and run decomposition jobs")
                       ->require_subcommand(1);
  AddJobList(job, program);
  const std::string named = "The name, the label, or the first digits of the digest of a job";
  AddAbout(job, program, "show", "Show a job", named, ShowJob);
  AddJobWatch(job, named, program);
  auto cancelled = std::make_shared<std::vector<std::string>>();
  CLI::App& cancel = *job.add_subcommand("cancel", "Cancel jobs that have not ended");
  cancel.add_option("job", *cancelled, named)->required();
  SetRun(cancel, program, [cancelled](const client::Client& daemon, bool json) {
    return CancelJobs(daemon, *cancelled, json);
  });
}

void AddMaterials(CLI::App& app, Program& program) {
  auto name = std::make_shared<std::string>();
  CLI::App& material = *app.add_subcommand(
      "material", "List the named materials, show the figures of one, or find one by recordings");
  material.add_option("material", *name, "The name of a material [a list of all]");
  AddMaterialFit(material, program);
  material.callback([&program, &material, name] {
    if (!material.get_subcommands().empty()) return;
    program.command = [&program, name] {
      return name->empty() ? ListMaterials(*program.Daemon(), program.json)
                           : ShowMaterial(*program.Daemon(), *name, program.json);
    };
  });
}

void AddExplain(CLI::App& app, Program& program) {
  auto name = std::make_shared<std::string>();
  CLI::App& explain = *app.add_subcommand(
      "explain", "Say what the reason of an error or the id of a warning means, and what to do");
  explain.add_option("reason", *name, "The reason, such as MESH_NOT_CLOSED [a list of all]");
  explain.callback([&program, name] {
    program.command = [&program, name] { return Explain(*name, program.json); };
  });
}

void AddScenes(CLI::App& app, Program& program) {
  CLI::App& scene =
      *app.add_subcommand("scene", "List, record and delete scenes")->require_subcommand(1);
  SetRun(*scene.add_subcommand("list", "List the scenes and their objects"), program, ListScenes);
  AddAbout(scene, program, "delete", "Fade out the objects of a scene and delete it",
           "The name or the number of a scene", DeleteScene);
  AddSceneRecord(scene, program);
}

void AddExample(CLI::App& app, Program& program) {
  auto name = std::make_shared<std::string>();
  auto size_m = std::make_shared<std::vector<double>>();
  auto out = std::make_shared<std::string>();
  std::vector<std::string> names;
  for (const Example& example : Examples()) names.push_back(example.name);
  CLI::App& command = *app.add_subcommand("example", "Write the mesh file of a body to try");
  command.add_option("example", *name, "bell, bowl, bar or chime")
      ->required()
      ->check(CLI::IsMember(names));
  command
      .add_option("--size", *size_m,
                  "Lengths along x, y and z to which the body is stretched, metres; "
                  "bar --size 0.14,0.07,0.01 is a block")
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::PositiveNumber);
  command.add_option("--out", *out, "The OBJ file to write [NAME.obj]")
      ->check([](const std::string& path) { return WhyNotWritten(path, {".obj"}); });
  command.callback([&program, name, size_m, out] {
    program.command = [&program, name, size_m, out] {
      const Example& example = *std::ranges::find(Examples(), *name, &Example::name);
      return WriteExample(example, *size_m, *out, program.json);
    };
  });
}

}  // namespace carillon::cli
