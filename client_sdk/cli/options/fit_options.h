// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

/// Adds `extract` and `fit` to `carillon material`.
void AddMaterialFit(CLI::App& material, Program& program);

}  // namespace carillon::cli
