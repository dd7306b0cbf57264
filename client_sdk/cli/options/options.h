// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/cli/commands/material_figures.h"
#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
}

namespace carillon::cli {

struct RenderOptions;

/// These functions add commands. The command that the user chooses sets `program.command`.
void AddConsole(CLI::App& app, Program& program);
void AddExample(CLI::App& app, Program& program);
void AddExplain(CLI::App& app, Program& program);
void AddFoley(CLI::App& app, Program& program);
void AddJob(CLI::App& app, Program& program);
void AddMaterialFit(CLI::App& material, Program& program);
void AddMaterials(CLI::App& app, Program& program);
void AddModel(CLI::App& app, Program& program);
void AddRender(CLI::App& app, Program& program);
void AddSceneRecord(CLI::App& scene, Program& program);
void AddScenes(CLI::App& app, Program& program);
void AddStop(CLI::App& app, Program& program);
void AddVolume(CLI::App& app, Program& program);

/// Adds the options of a sound file to a command.
void AddSound(CLI::App& render, RenderOptions& options);

/// Adds the options that describe a material to a command. `app` and `material` must outlive the
/// parsing.
void AddMaterial(CLI::App& app, MaterialFigures& material);

}  // namespace carillon::cli
