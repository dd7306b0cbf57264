// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/options/unknown_word.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/near_names.h"

namespace carillon::cli {
namespace {

/// Returns the commands of an app, or with `grouped` the groups of its options, which are commands
/// without names for the library.
std::vector<const CLI::App*> Parts(const CLI::App& app, bool grouped) {
  return app.get_subcommands(
      [grouped](const CLI::App* part) { return part->get_name().empty() == grouped; });
}

/// Adds the long names of an app's options.
void AddOptionNames(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  for (const CLI::App* group : Parts(app, true)) AddOptionNames(*group, names);
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : Parts(app, false)) names.push_back(command->get_name());
  return names;
}

std::string Suggestion(const std::string& kind, const std::string& word,
                       const std::vector<std::string>& names) {
  const std::vector<std::string> near = NearNames(word, names);
  std::string text = absl::StrCat("there is no ", kind, " '", word, "'");
  if (near.empty()) return absl::StrCat(text, "; run with --help for all");
  return absl::StrCat(text, "; did you mean '", absl::StrJoin(near, "' or '"), "'?");
}

/// Returns the option that the word "--name" or "--name=value" names to a command or to one of
/// those before it.
const CLI::Option* FindOption(const std::vector<const CLI::App*>& path, const std::string& name) {
  for (const CLI::App* command : path) {
    if (const CLI::Option* option = command->get_option_no_throw(name)) return option;
  }
  return nullptr;
}

}  // namespace

std::string UnknownWord(const CLI::App& app, int argc, const char* const* argv) {
  std::vector<const CLI::App*> path = {&app};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") return "";
    if (word.starts_with("--")) {
      const std::vector<std::string> parts = absl::StrSplit(word, absl::MaxSplits('=', 1));
      const CLI::Option* option = FindOption(path, parts[0]);
      if (option == nullptr) {
        std::vector<std::string> names;
        for (const CLI::App* command : path) AddOptionNames(*command, names);
        return Suggestion("option", parts[0], names);
      }
      // The words of its value may be fewer, because a vector may be one word.
      for (int left = option->get_items_expected_min(); parts.size() == 1 && left > 0; --left) {
        if (i + 1 < argc && absl::string_view(argv[i + 1]).substr(0, 2) != "--") ++i;
      }
    } else if (const std::vector<std::string> names = CommandNames(*path.back()); !names.empty()) {
      const bool known = std::ranges::find(names, word) != names.end();
      if (!known && path.back()->get_name() == "material") {
        return absl::StrCat("there is no command '", word,
                            "'; `carillon material` lists the materials, and `carillon material "
                            "oak` shows one");
      }
      if (!known) return Suggestion("command", word, names);
      path.push_back(path.back()->get_subcommand(word));
    }
  }
  return "";
}

}  // namespace carillon::cli
