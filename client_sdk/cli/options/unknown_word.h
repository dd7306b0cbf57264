// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Returns a sentence about the first word of a command line that is no command or no option, such
/// as "there is no command 'modal'; did you mean 'model'?". Returns an empty string if every word
/// is known.
std::string UnknownWord(const CLI::App& app, int argc, const char* const* argv);

}  // namespace carillon::cli
