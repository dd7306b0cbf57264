// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "client_sdk/cli/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// The shells for which `carillon completion` prints a script.
inline constexpr std::array kShells = {"bash", "zsh", "fish"};

/// Returns the kind of names that an argument or the value of an option takes, such as "models" for
/// "model" and "materials" for "--material". Returns an empty string if it takes no names of a
/// known kind.
std::string KindOfNames(const std::string& argument);

/// Adds `carillon names KIND`, which --help does not list. The scripts of `carillon completion`
/// call it for the names of the daemon's models, jobs and scenes, and for those that the program
/// knows itself. Where no daemon answers within a second, it prints nothing.
void AddNames(CLI::App& app, Program& program);

}  // namespace carillon::cli
