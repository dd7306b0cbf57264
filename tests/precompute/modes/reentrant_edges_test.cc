// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/reentrant_edges.h"

#include <gtest/gtest.h>

#include <cmath>

#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/error_estimate.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr double kLegM = 0.03, kWallM = 0.01, kLengthM = 0.04;

/// An L profile along the z axis whose inner edge is at x = y = kWallM.
TetMesh Angle(int cells_in_wall) {
  const TetMesh box = MakeTetBox({kLegM, kLegM, kLengthM},
                                 {3 * cells_in_wall, 3 * cells_in_wall, 3 * cells_in_wall}, 10);
  return Part(box, [](const Point& p) { return p[0] < kWallM || p[1] < kWallM; });
}

bool IsOnInnerEdge(const Point& p) {
  return std::abs(p[0] - kWallM) < 1e-9 && std::abs(p[1] - kWallM) < 1e-9;
}

TEST(ReentrantNodes, AreNoneOfAConvexBody) {
  for (const double value : ReentrantNodes(MakeTetBox({1, 2, 3}, {2, 3, 4}, 4))) {
    EXPECT_EQ(value, 0);
  }
}

TEST(ReentrantNodes, AreThoseOfTheInnerEdgeOfAnAngle) {
  const TetMesh mesh = Angle(2);
  const std::vector<double> values = ReentrantNodes(mesh);
  ASSERT_EQ(values.size(), mesh.nodes.size());
  int count = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t i = 0; i < 4; ++i) {
      const auto node = static_cast<size_t>(mesh.elements[10 * e + i]);
      EXPECT_NEAR(values[node], IsOnInnerEdge(mesh.nodes[node]) ? 1 : 0, 1e-9);
      count += values[node] > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(count, 0);
}

TEST(ErrorEstimate, CoversTheErrorsOfABodyWithAReentrantEdge) {
  constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.3};
  const auto solve = [&](const TetMesh& mesh) {
    auto solution = SolveDeformationModes(Assemble(mesh, kElastic, 1, MassSharing::kConsistent),
                                          mesh.nodes, 4e4, [](SolveStage, double) {});
    EXPECT_TRUE(solution.ok()) << solution.status();
    return *std::move(solution);
  };
  const TetMesh mesh = Angle(1);
  const DeformationModes coarse = solve(mesh);
  const DeformationModes fine = solve(Angle(4));
  const Eigen::VectorXd errors = EstimateFrequencyErrors(mesh, kElastic, coarse.modes).errors;
  ASSERT_GE(fine.modes.eigenvalues.size(), 4);
  ASSERT_GE(errors.size(), 4);
  for (Eigen::Index m = 0; m < 4; ++m) {
    const double right = std::sqrt(coarse.modes.eigenvalues[m] / fine.modes.eigenvalues[m]) - 1;
    EXPECT_GT(right, 1e-3);
    EXPECT_GT(errors[m], right) << "mode " << m;
    EXPECT_LT(errors[m], 3 * right) << "mode " << m << ", in truth " << right;
  }
}

}  // namespace
}  // namespace carillon::precompute
