// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Adds `carillon model` and its commands. The command that the user chooses sets
/// `program.command`.
void AddModel(CLI::App& app, Program& program);

}  // namespace carillon::cli
