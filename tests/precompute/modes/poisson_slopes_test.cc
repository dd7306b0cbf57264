// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/poisson_slopes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

TEST(PoissonSlopes, AreTheDifferencesOfTwoDecompositions) {
  constexpr double kStep = 1e-3;
  const TetMesh free = MakeTetBox({1, 0.4, 0.3}, {4, 2, 2}, 10);
  TetMesh fixed = free;
  for (size_t n = 0; n < free.nodes.size(); ++n) {
    if (free.nodes[n][0] == 0) fixed.fixed.push_back(static_cast<int32_t>(n));
  }
  const auto at = [](double nu) { return ElasticConstants{.young_pa = 1, .poisson_ratio = nu}; };
  for (const double nu : {-0.3, 0.0, 0.19, 0.33}) {
    for (const TetMesh& mesh : {free, fixed}) {
      const Eigen::VectorXd slopes =
          PoissonSlopes(mesh, at(nu), ModesBelow(60, mesh, at(nu)).modes);
      const DeformationModes below = ModesBelow(60, mesh, at(nu - kStep));
      const DeformationModes above = ModesBelow(60, mesh, at(nu + kStep));
      ASSERT_GE(slopes.size(), 6);
      for (Eigen::Index m = 0; m < 6; ++m) {
        const double difference =
            std::log(above.modes.eigenvalues[m] / below.modes.eigenvalues[m]) / (2 * kStep);
        // The third derivative times kStep^2 / 6 is some 1e-5.
        EXPECT_NEAR(slopes[m], difference, 1e-4)
            << "mode " << m << ", ratio " << nu << (mesh.fixed.empty() ? "" : ", fixed");
      }
    }
  }
}

}  // namespace
}  // namespace carillon::precompute
