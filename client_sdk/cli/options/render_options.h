// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

struct RenderOptions;

/// Adds the options of a sound file.
void AddSound(CLI::App& render, RenderOptions& options);

/// Adds `carillon render`.
void AddRender(CLI::App& app, Program& program);

}  // namespace carillon::cli
