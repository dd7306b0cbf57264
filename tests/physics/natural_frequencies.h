// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

inline constexpr ElasticConstants kSteel{.young_pa = 210e9, .poisson_ratio = 0.3};
inline constexpr double kSteelDensity = 7850;

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

/// Expects found[0], found[step], found[2 step]... to be `expected_hz` of 1, 2, 3... to `count`.
template <typename ExpectedHz>
void ExpectSeries(const std::vector<double>& found, size_t step, size_t count,
                  ExpectedHz expected_hz, double tolerance) {
  ASSERT_GE(found.size(), step * count);
  for (size_t n = 1; n <= count; ++n) {
    EXPECT_NEAR(found[step * (n - 1)] / expected_hz(static_cast<int>(n)), 1, tolerance) << n;
  }
}

/// Expects the first frequencies to come in pairs that differ by at most `split` of themselves.
inline void ExpectPairs(const std::vector<double>& found, size_t count, double split) {
  ASSERT_GE(found.size(), 2 * count);
  for (size_t m = 0; m < 2 * count; m += 2) EXPECT_NEAR(found[m + 1] / found[m], 1, split) << m;
}

}  // namespace carillon::precompute
