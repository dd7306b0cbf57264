// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/name_options.h"

#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/example_bodies.h"
#include "client_sdk/cli/output.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/program/manual_page.h"
#include "proto/cpp/striker_catalogue.h"

namespace carillon::cli {
namespace {

constexpr unsigned kPatienceS = 1;
constexpr std::array kKinds = {"materials", "strikers", "models",   "jobs",
                               "scenes",    "examples", "commands", "shells"};
constexpr size_t kShortDigest = 12;

/// Ends the program without a word when the daemon lets a shell wait.
void EndInTime() {
  signal(SIGALRM, [](int) { _exit(kDone); });
  alarm(kPatienceS);
}

/// Whether shells take the text as one word without quotation marks.
bool IsPlainWord(absl::string_view text) {
  return !text.empty() && text.front() != '-' && std::ranges::all_of(text, [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '+' || c == '-';
  });
}

/// Prints the label of each item or, where several have it or it is no plain word, the first digits
/// of the digest in its name.
template <class Item>
void PrintLabels(const std::vector<Item>& items, absl::string_view prefix) {
  std::map<std::string, int> counts;
  for (const Item& item : items) ++counts[item.label()];
  for (const Item& item : items) {
    const bool names_it = counts[item.label()] == 1 && IsPlainWord(item.label());
    const absl::string_view digest = absl::StripPrefix(item.name(), prefix).substr(0, kShortDigest);
    absl::PrintF("%s\n", names_it ? absl::string_view(item.label()) : digest);
  }
}

void PrintNamesOfDaemon(const client::Client& daemon, const std::string& kind) {
  if (kind == "models") {
    if (const auto models = daemon.ListModalModels(); models.ok()) {
      PrintLabels(*models, "modalModels/");
    }
  } else if (kind == "jobs") {
    if (const auto jobs = daemon.ListJobs(); jobs.ok()) PrintLabels(*jobs, "jobs/");
  } else if (const auto scenes = daemon.ListScenes(); scenes.ok()) {
    for (const v1::Scene& scene : *scenes) {
      absl::PrintF("%s\n", absl::StripPrefix(scene.name(), "scenes/"));
    }
  }
}

absl::Status PrintNames(const CLI::App& app, const Program& program, const std::string& kind) {
  if (kind == "materials") {
    for (const auto& item : Materials().materials()) absl::PrintF("%s\n", item.name());
  } else if (kind == "strikers") {
    for (const auto& item : Strikers().strikers()) absl::PrintF("%s\n", item.name());
  } else if (kind == "examples") {
    for (const Example& item : Examples()) absl::PrintF("%s\n", item.name);
  } else if (kind == "commands") {
    for (const CLI::App* item : ListedCommands(app)) absl::PrintF("%s\n", item->get_name());
  } else if (kind == "shells") {
    for (const char* shell : kShells) absl::PrintF("%s\n", shell);
  } else {
    EndInTime();
    PrintNamesOfDaemon(*program.Daemon(), kind);
  }
  return absl::OkStatus();
}

}  // namespace

std::string KindOfNames(const std::string& argument) {
  const absl::string_view name = absl::StripPrefix(argument, "--");
  for (const absl::string_view kind : kKinds) {
    if (name == kind.substr(0, kind.size() - 1)) return std::string(kind);
  }
  return "";
}

void AddNames(CLI::App& app, Program& program) {
  auto kind = std::make_shared<std::string>();
  CLI::App& names = *app.add_subcommand("names", "Print names for the completion of a shell");
  names.group("");
  names.add_option("kind", *kind, "What the names stand for")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kKinds.begin(), kKinds.end())));
  names.callback([&app, &program, kind] {
    program.command = [&app, &program, kind] { return PrintNames(app, program, *kind); };
  });
}

}  // namespace carillon::cli
