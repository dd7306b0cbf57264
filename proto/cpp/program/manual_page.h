// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
class Option;
}  // namespace CLI

namespace carillon {

/// Adds the flag --man, which --help does not list, to a program. With this flag the program prints
/// its manual page, for `man`, and ends. The page has the texts of --help. `section` is 1 for
/// commands of users and 8 for daemons.
void AddManualFlag(CLI::App& app, int section, const std::string& version);

/// Returns the manual page as man(7) describes it.
std::string ManualPage(const CLI::App& app, int section, const std::string& version);

/// Returns the options that --help lists, except positional options and --help itself.
std::vector<const CLI::Option*> ListedOptions(const CLI::App& app);

/// Returns the commands of a program or of a command that --help lists.
std::vector<const CLI::App*> ListedCommands(const CLI::App& app);

}  // namespace carillon
