// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker_command.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/fixture_text.h"
#include "server/decomposition/shortest_decimal.h"

namespace carillon {

std::vector<std::string> WorkerCommand(const v1::CreateModalModelRequest& resolved, uint32_t way,
                                       const WorkerPlace& place) {
  const v1::DecompositionSettings& settings = resolved.settings();
  const v1::Material& material = resolved.material();
  const v1::MeshSettings& mesh = settings.mesh();
  // "--name=value", so that a negative number is no option.
  const auto option = [](const char* name, double value) {
    return absl::StrCat("--", name, "=", ShortestDecimal(value));
  };
  std::vector<std::string> command = {
      place.program.string(),
      place.mesh_file.string(),
      absl::StrCat("--out=", place.model_file.string()),
      absl::StrCat("--format=", resolved.mesh_format()),
      option("young", material.young_pa()),
      option("poisson", settings.poisson_ratio()),
      option("density", material.density_kg_per_m3()),
      option("alpha1", material.alpha1_s()),
      option("alpha2", material.alpha2_per_s()),
      absl::StrCat("--element=", settings.element() == v1::ELEMENT_LINEAR ? "linear" : "quadratic"),
      absl::StrCat("--mass=",
                   settings.mass_matrix() == v1::MASS_MATRIX_LUMPED ? "lumped" : "consistent"),
      option("unit", settings.metres_per_unit()),
      option("size", resolved.size()),
      absl::StrCat("--band=", ShortestDecimal(resolved.min_frequency_hz()), ":",
                   ShortestDecimal(resolved.max_frequency_hz())),
      absl::StrCat("--threads=", place.thread_count),
      "--events-fd=3"};
  if (mesh.has_keep_surface()) {
    command.emplace_back(mesh.keep_surface() ? "--keep-surface" : "--refine-surface");
  }
  if (mesh.target_node_count() > 0) {
    command.push_back(absl::StrCat("--nodes=", mesh.target_node_count()));
  }
  if (way >= 1) command.emplace_back("--cautious");
  if (mesh.repair() || way >= 2) command.emplace_back("--repair");
  if (mesh.wall_m() > 0) command.push_back(option("wall", mesh.wall_m()));
  if (mesh.accuracy() > 0) command.push_back(option("accuracy", mesh.accuracy()));
  if (mesh.budget_s() > 0 || mesh.budget_gib() > 0) {
    command.push_back(absl::StrCat("--budget=", ShortestDecimal(mesh.budget_s()), ":",
                                   ShortestDecimal(mesh.budget_gib())));
  }
  if (settings.keep_mode_count() > 0) {
    command.push_back(absl::StrCat("--keep=", settings.keep_mode_count()));
  }
  for (const v1::Fixture& fixture : settings.fixtures()) {
    command.push_back(absl::StrCat("--fix=", FixtureText(fixture).value_or("")));
  }
  return command;
}

}  // namespace carillon
