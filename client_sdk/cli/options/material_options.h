// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/material_figures.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Adds the options that describe a material to a command. `app` and `material` must outlive the
/// parsing.
void AddMaterial(CLI::App& app, MaterialFigures& material);

}  // namespace carillon::cli
