// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Adds the command `foley`.
void AddFoley(CLI::App& app, Program& program);

}  // namespace carillon::cli
