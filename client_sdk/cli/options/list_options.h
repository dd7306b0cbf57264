// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// These functions add `carillon job`, `carillon material`, `carillon explain`, `carillon scene`
/// and `carillon example` with their commands.
void AddJob(CLI::App& app, Program& program);
void AddMaterials(CLI::App& app, Program& program);
void AddExplain(CLI::App& app, Program& program);
void AddScenes(CLI::App& app, Program& program);
void AddExample(CLI::App& app, Program& program);

}  // namespace carillon::cli
