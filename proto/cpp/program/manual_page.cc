// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/manual_page.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace carillon {
namespace {

/// Escapes the characters that man(7) takes for commands.
std::string Plain(const std::string& text) {
  std::string plain = absl::StrReplaceAll(text, {{"\\", "\\e"}, {"-", "\\-"}});
  if (plain.starts_with('.') || plain.starts_with('\'')) plain.insert(0, "\\&");
  return plain;
}

std::string Bold(const std::string& text) { return absl::StrCat("\\fB", Plain(text), "\\fR"); }

/// Returns the form of the value of an option, such as "TEXT"; empty for a flag.
std::string ValueForm(const CLI::Option& option) {
  return option.get_items_expected_max() == 0 ? "" : option.get_type_name();
}

std::string OptionEntry(const CLI::Option& option) {
  const std::string form = ValueForm(option);
  std::string entry = absl::StrCat(".TP\n", Bold(option.get_name(false, true)));
  if (!form.empty()) absl::StrAppend(&entry, " \\fI", Plain(form), "\\fR");
  std::string text = option.get_description();
  const std::string value = option.get_default_str();
  // A path belongs to the machine that prints the page, which may not be that of the reader.
  const bool shown = !value.empty() && !form.empty() && !absl::StrContains(value, '/');
  if (shown) absl::StrAppend(&text, " [", value, "]");
  return absl::StrCat(entry, "\n", Plain(text), "\n");
}

std::string Synopsis(const CLI::App& app, const std::string& path) {
  std::string line = absl::StrCat(Bold(path), " [\\fIOPTIONS\\fR]");
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const std::string word = absl::AsciiStrToUpper(option->get_name(true));
    const std::string more = option->get_items_expected_max() > 1 ? "..." : "";
    absl::StrAppend(&line, " ", option->get_required() ? "" : "[", "\\fI", word, "\\fR", more,
                    option->get_required() ? "" : "]");
  }
  if (!ListedCommands(app).empty()) absl::StrAppend(&line, " \\fICOMMAND\\fR");
  return line;
}

std::string Options(const CLI::App& app) {
  std::string entries;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    absl::StrAppend(&entries, ".TP\n\\fI", absl::AsciiStrToUpper(option->get_name(true)), "\\fR\n",
                    Plain(option->get_description()), "\n");
  }
  for (const CLI::Option* option : ListedOptions(app)) {
    absl::StrAppend(&entries, OptionEntry(*option));
  }
  return entries;
}

std::string Commands(const CLI::App& app, const std::string& path) {
  std::string sections;
  for (const CLI::App* command : ListedCommands(app)) {
    const std::string name = absl::StrCat(path, " ", command->get_name());
    if (ListedCommands(*command).empty()) {
      absl::StrAppend(&sections, ".SS ", Synopsis(*command, name), "\n",
                      Plain(command->get_description()), ".\n", Options(*command));
    }
    absl::StrAppend(&sections, Commands(*command, name));
  }
  return sections;
}

}  // namespace

std::vector<const CLI::Option*> ListedOptions(const CLI::App& app) {
  std::vector<const CLI::Option*> options = app.get_options([](const CLI::Option* option) {
    return !option->get_positional() && !option->get_group().empty() &&
           option->get_lnames() != std::vector<std::string>{"help"};
  });
  // CLI11 keeps a group of options as a command without a name.
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* command) { return command->get_name().empty(); })) {
    for (const CLI::Option* option : ListedOptions(*group)) options.push_back(option);
  }
  return options;
}

std::vector<const CLI::App*> ListedCommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) {
    return !command->get_group().empty() && !command->get_name().empty();
  });
}

std::string ManualPage(const CLI::App& app, int section, const std::string& version) {
  const std::string& name = app.get_name();
  const std::string commands = Commands(app, name);
  std::string page = absl::StrCat(
      ".TH ", absl::AsciiStrToUpper(name), " ", section, " \"\" \"Carillon ", version,
      "\" \"Carillon\"\n.SH NAME\n", Plain(name), " \\- ", Plain(app.get_description()),
      "\n.SH SYNOPSIS\n", Synopsis(app, name), "\n.SH OPTIONS\n", Options(app));
  if (!commands.empty()) absl::StrAppend(&page, ".SH COMMANDS\n", commands);
  if (const std::string footer = app.get_footer(); !footer.empty()) {
    absl::StrAppend(&page, ".SH NOTES\n", Plain(footer), "\n");
  }
  return page;
}

void AddManualFlag(CLI::App& app, int section, const std::string& version) {
  app.add_flag_callback(
         "--man",
         [&app, section, version] {
           std::cout << ManualPage(app, section, version);
           throw CLI::Success();
         },
         "Print the manual page")
      ->group("");
}

}  // namespace carillon
