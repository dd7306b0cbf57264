// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/completion_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client_sdk/cli/name_options.h"
#include "proto/cpp/near_names.h"
#include "proto/cpp/program/manual_page.h"

namespace carillon::cli {
namespace {

/// Calls `take` with every command and its words, such as " model create"; the program has none.
void ForEachCommand(const CLI::App& app, const std::string& path,
                    const std::function<void(const CLI::App&, const std::string&)>& take) {
  take(app, path);
  for (const CLI::App* command : ListedCommands(app)) {
    ForEachCommand(*command, absl::StrCat(path, " ", command->get_name()), take);
  }
}

std::vector<std::string> LongNames(const CLI::App& app) {
  std::vector<std::string> names = {"--help"};
  for (const CLI::Option* option : ListedOptions(app)) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : ListedCommands(app)) names.push_back(command->get_name());
  return names;
}

/// Returns the commands of a shell that print the names which the command's own arguments take.
std::vector<std::string> NamesOfArguments(const CLI::App& app) {
  std::vector<std::string> calls;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const std::string kind = KindOfNames(option->get_single_name());
    if (!kind.empty()) calls.push_back(absl::StrCat("$(_carillon_names ", kind, ")"));
  }
  return calls;
}

/// Returns the lines of a `case` by the word before, whose names take the place of all else.
std::string CasesOfValues(absl::string_view list_form) {
  std::string lines = "  case \"$before\" in\n";
  for (const char* option : {"--material", "--striker", "--scene"}) {
    const std::string names = absl::StrCat("$(_carillon_names ", KindOfNames(option), ")");
    absl::StrAppend(&lines, "    ", option, ") ", absl::StrReplaceAll(list_form, {{"LIST", names}}),
                    " ;;\n");
  }
  return absl::StrCat(lines, "  esac\n");
}

/// Returns the lines of a `case` that follow the words of a command line, and those that list what
/// may come next, in the language that bash and zsh share. Their variable is not named `path`,
/// because zsh would then find no program.
std::string Cases(const CLI::App& app, absl::string_view list_form) {
  std::vector<std::string> paths;
  std::string lists;
  ForEachCommand(app, "", [&](const CLI::App& command, const std::string& path) {
    if (!path.empty()) paths.push_back(absl::StrCat("\"", path, "\""));
    std::vector<std::string> next = CommandNames(command);
    for (const std::string& name : NamesOfArguments(command)) next.push_back(name);
    for (const std::string& name : LongNames(command)) next.push_back(name);
    absl::StrAppend(&lists, "    \"", path, "\") ",
                    absl::StrReplaceAll(list_form, {{"LIST", absl::StrJoin(next, " ")}}), " ;;\n");
  });
  return absl::StrCat("    case \"$chain $word\" in\n      ", absl::StrJoin(paths, " | "),
                      ") chain=\"$chain $word\" ;;\n    esac\n  done\n  case \"$chain\" in\n",
                      lists, "  esac\n", CasesOfValues(list_form));
}

/// The function by which bash and zsh ask for names, unless an option is being typed.
constexpr char kNamesFunction[] =
    "_carillon_names() {\n  [[ $current == -* ]] || \"$program\" names \"$1\" 2>/dev/null\n}\n";

std::string BashScript(const CLI::App& app) {
  return absl::StrCat(
      kNamesFunction,
      "_carillon() {\n  local chain=\"\" word choices program=\"${COMP_WORDS[0]}\"\n",
      "  local current=\"${COMP_WORDS[COMP_CWORD]}\" before=\"${COMP_WORDS[COMP_CWORD-1]}\"\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n",
      Cases(app, "choices=\"LIST\""),
      "  COMPREPLY=($(compgen -W \"$choices\" -- \"${COMP_WORDS[COMP_CWORD]}\"))\n"
      "}\ncomplete -o default -F _carillon carillon\n");
}

std::string ZshScript(const CLI::App& app) {
  return absl::StrCat("#compdef carillon\n", kNamesFunction,
                      "_carillon() {\n  local chain=\"\" word program=\"${words[1]}\"\n",
                      "  local current=\"${words[CURRENT]}\" before=\"${words[CURRENT-1]}\"\n",
                      "  local -a choices\n  for word in \"${(@)words[2,CURRENT-1]}\"; do\n",
                      Cases(app, "choices=(LIST)"),
                      "  compadd -a choices\n  [[ ${words[CURRENT]} == -* ]] || _files\n}\n"
                      "compdef _carillon carillon\n");
}

std::string FishLine(const std::string& path, const std::string& what, const std::string& text) {
  return absl::StrFormat("complete -c carillon -n 'test (__carillon_path) = \"%s\"' %s -d '%s'\n",
                         path, what, absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"'", "\\'"}}));
}

/// Returns the part of a line for fish by which an argument takes names only; empty if it takes
/// others.
std::string FishNames(const std::string& argument) {
  const std::string kind = KindOfNames(argument);
  if (kind.empty()) return "";
  return absl::StrCat(" -f -a '(carillon names ", kind, " 2>/dev/null)'");
}

std::string FishScript(const CLI::App& app) {
  std::string paths;
  std::string lines;
  ForEachCommand(app, "", [&](const CLI::App& command, const std::string& path) {
    if (!path.empty()) absl::StrAppend(&paths, " '", path, "'");
    for (const CLI::App* next : ListedCommands(command)) {
      absl::StrAppend(&lines, FishLine(path, "-f -a " + next->get_name(), next->get_description()));
    }
    for (const CLI::Option* option : command.get_options()) {
      if (!option->get_positional()) continue;
      const std::string names = FishNames(option->get_single_name());
      if (!names.empty()) absl::StrAppend(&lines, FishLine(path, names, "name"));
    }
    for (const CLI::Option* option : ListedOptions(command)) {
      for (const std::string& name : option->get_lnames()) {
        const char* needed = option->get_items_expected_max() > 0 ? " -r" : "";
        const std::string value = absl::StrCat(needed, FishNames(name));
        absl::StrAppend(
            &lines, FishLine(path, absl::StrCat("-l ", name, value), option->get_description()));
      }
    }
  });
  return absl::StrCat(
      "function __carillon_path\n  set -l path ''\n  for word in (commandline -opc)[2..-1]\n"
      "    contains -- \"$path $word\"",
      paths, "; and set path \"$path $word\"\n  end\n  echo \"$path\"\nend\n", lines);
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
        for (const CLI::App* command : path) {
          for (const std::string& name : LongNames(*command)) names.push_back(name);
        }
        return Suggestion("option", parts[0], names);
      }
      // The words of its value may be fewer, because a vector may be one word.
      for (int left = option->get_items_expected_min(); parts.size() == 1 && left > 0; --left) {
        if (i + 1 < argc && absl::string_view(argv[i + 1]).substr(0, 2) != "--") ++i;
      }
    } else if (const std::vector<std::string> names = CommandNames(*path.back()); !names.empty()) {
      if (std::ranges::find(names, word) == names.end()) return Suggestion("command", word, names);
      path.push_back(path.back()->get_subcommand(word));
    }
  }
  return "";
}

std::string CompletionScript(const CLI::App& app, const std::string& shell) {
  return shell == "bash" ? BashScript(app) : shell == "zsh" ? ZshScript(app) : FishScript(app);
}

void AddCompletion(CLI::App& app, Program& program) {
  auto shell = std::make_shared<std::string>();
  CLI::App& command =
      *app.add_subcommand("completion", "Print a script that completes commands in a shell");
  command.add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(kShells.begin(), kShells.end())));
  command.callback([&app, &program, shell] {
    program.command = [&app, shell] {
      absl::PrintF("%s", CompletionScript(app, *shell));
      return absl::OkStatus();
    };
  });
}

}  // namespace carillon::cli
