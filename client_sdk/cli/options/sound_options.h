// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// These functions add `carillon console`, `carillon volume`, `carillon stop` and `carillon scene
/// record`.
void AddConsole(CLI::App& app, Program& program);
void AddVolume(CLI::App& app, Program& program);
void AddStop(CLI::App& app, Program& program);
void AddSceneRecord(CLI::App& scene, Program& program);

}  // namespace carillon::cli
