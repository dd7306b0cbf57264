// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

/// A body's deformation modes below `limit_hz`, solved for with the material itself.
inline DeformationModes ModesOf(const TetMesh& mesh, const ElasticConstants& elastic,
                                double density_kg_per_m3, double limit_hz,
                                MassSharing sharing = MassSharing::kConsistent) {
  const SystemMatrices system = Assemble(mesh, elastic, density_kg_per_m3, sharing);
  const double omega = 2 * std::numbers::pi * limit_hz;
  absl::StatusOr<DeformationModes> modes =
      SolveDeformationModes(system, mesh, omega * omega, [](SolveStage, double) {});
  EXPECT_TRUE(modes.ok()) << modes.status();
  return *std::move(modes);
}

/// Their natural frequencies, Hz.
inline std::vector<double> FrequenciesHz(const DeformationModes& solution) {
  std::vector<double> frequencies;
  for (const double eigenvalue : solution.modes.eigenvalues) {
    frequencies.push_back(std::sqrt(eigenvalue) / (2 * std::numbers::pi));
  }
  return frequencies;
}

}  // namespace carillon::precompute
