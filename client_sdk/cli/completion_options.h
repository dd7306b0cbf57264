// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "client_sdk/cli/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Adds `carillon completion SHELL`, which prints a script for a shell. The script completes the
/// commands and options of `app`, which must have all of them when the command runs.
void AddCompletion(CLI::App& app, Program& program);

/// Returns the script for "bash", "zsh" or "fish".
std::string CompletionScript(const CLI::App& app, const std::string& shell);

/// Returns a sentence about the first word of a command line that is no command or no option, such
/// as "there is no command 'modal'; did you mean 'model'?". Returns an empty string if every word
/// is known.
std::string UnknownWord(const CLI::App& app, int argc, const char* const* argv);

}  // namespace carillon::cli
