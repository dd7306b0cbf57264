// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/poisson_slopes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "precompute/fem/assembly.h"
#include "precompute/modes/deformation_modes.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

DeformationModes Solve(const TetMesh& mesh, double nu) {
  const ElasticConstants elastic{.young_pa = 1, .poisson_ratio = nu};
  auto solution = SolveDeformationModes(Assemble(mesh, elastic, 1, MassSharing::kConsistent), mesh,
                                        60, [](SolveStage, double) {}, {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return *std::move(solution);
}

class SlopesAtRatio : public testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(Ratios, SlopesAtRatio, testing::Values(-0.3, 0.0, 0.19, 0.33));

TEST_P(SlopesAtRatio, AreTheDifferencesOfTwoDecompositions) {
  const double nu = GetParam();
  constexpr double kStep = 1e-3;
  TetMesh mesh = MakeTetBox({1, 0.4, 0.3}, {4, 2, 2}, 10);
  for (const bool fixed : {false, true}) {
    if (fixed) {
      for (size_t n = 0; n < mesh.nodes.size(); ++n) {
        if (mesh.nodes[n][0] == 0) mesh.fixed.push_back(static_cast<int32_t>(n));
      }
    }
    const DeformationModes at = Solve(mesh, nu);
    const Eigen::VectorXd slopes =
        PoissonSlopes(mesh, {.young_pa = 1, .poisson_ratio = nu}, at.modes);
    const DeformationModes below = Solve(mesh, nu - kStep), above = Solve(mesh, nu + kStep);
    ASSERT_GE(slopes.size(), 6);
    for (Eigen::Index m = 0; m < 6; ++m) {
      const double difference =
          std::log(above.modes.eigenvalues[m] / below.modes.eigenvalues[m]) / (2 * kStep);
      // The third derivative times kStep^2 / 6 is some 1e-5.
      EXPECT_NEAR(slopes[m], difference, 1e-4) << "mode " << m << (fixed ? ", fixed" : "");
    }
  }
}

}  // namespace
}  // namespace carillon::precompute
