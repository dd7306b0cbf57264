// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/error_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "precompute/modes/deformation_modes.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.3};

/// A plate whose two thinnest cells are far from enough for linear elements.
struct Mesh {
  std::array<int, 3> cells;
  int nodes_per_element;
};

DeformationModes Solve(const TetMesh& mesh, double limit) {
  auto solution = SolveDeformationModes(Assemble(mesh, kElastic, 1, MassSharing::kConsistent),
                                        mesh.nodes, limit, [](SolveStage, double) {});
  EXPECT_TRUE(solution.ok()) << solution.status();
  return *std::move(solution);
}

class EstimateTest : public testing::TestWithParam<Mesh> {};

INSTANTIATE_TEST_SUITE_P(Meshes, EstimateTest,
                         testing::Values(Mesh{{12, 4, 3}, 4}, Mesh{{24, 8, 6}, 4},
                                         Mesh{{6, 3, 2}, 10}, Mesh{{12, 5, 3}, 10}),
                         [](const auto& tested) {
                           return "Mesh" + std::to_string(tested.param.cells[0]) + "Of" +
                                  std::to_string(tested.param.nodes_per_element);
                         });

TEST_P(EstimateTest, IsNearTheTrueErrorAndSeldomBelowIt) {
  const Point size{1, 0.4, 0.3};
  constexpr double kLimit = 60;
  const DeformationModes fine = Solve(MakeTetBox(size, {20, 8, 6}, 10), kLimit);
  const auto& [cells, nodes_per_element] = GetParam();
  const TetMesh mesh = MakeTetBox(size, cells, nodes_per_element);
  const DeformationModes coarse = Solve(mesh, 2 * kLimit);
  const Eigen::VectorXd errors = EstimateFrequencyErrors(mesh, kElastic, coarse.modes).errors;
  ASSERT_GE(fine.modes.eigenvalues.size(), 6);
  ASSERT_GE(errors.size(), fine.modes.eigenvalues.size());
  // Further up the coarsest mesh has other modes in between.
  for (Eigen::Index m = 0; m < 6; ++m) {
    const double right = std::sqrt(coarse.modes.eigenvalues[m] / fine.modes.eigenvalues[m]) - 1;
    // The fine mesh has an error of its own, some 1e-5.
    EXPECT_GT(errors[m], 0.8 * right - 2e-5) << "mode " << m << ", in truth " << right;
    EXPECT_LT(errors[m], 3 * right + 2e-5) << "mode " << m << ", in truth " << right;
  }
}

TEST(ErrorEstimate, HasItsLargestSharesWhereElementsAreCoarse) {
  // Cells that are four times as long in the half of high x.
  TetMesh mesh = MakeTetBox({1, 0.2, 0.2}, {20, 2, 2}, 4);
  for (Point& p : mesh.nodes) p[0] = p[0] < 0.5 ? p[0] : 0.5 + 4 * (p[0] - 0.5);
  const DeformationModes solution = Solve(mesh, 60);
  ASSERT_GT(solution.modes.eigenvalues.size(), 0);
  const std::vector<double> at_node =
      EstimateFrequencyErrors(mesh, kElastic, solution.modes).at_node;
  ASSERT_EQ(at_node.size(), mesh.nodes.size());
  double fine = 0, coarse = 0;
  for (size_t n = 0; n < at_node.size(); ++n) {
    EXPECT_GE(at_node[n], 0);
    (mesh.nodes[n][0] < 0.5 ? fine : coarse) += at_node[n];
  }
  EXPECT_GT(fine, 0);
  EXPECT_GT(coarse, 3 * fine);
}

TEST(EstimateOfCurvedElements, IsNearTheTrueErrorAndSeldomBelowIt) {
  constexpr double kLimit = 4;
  const DeformationModes fine = Solve(MakeTetSphere(1, 700, true), kLimit);
  const TetMesh mesh = MakeTetSphere(1, 150, true);
  const DeformationModes coarse = Solve(mesh, kLimit * 1.1);
  const Eigen::VectorXd errors = EstimateFrequencyErrors(mesh, kElastic, coarse.modes).errors;
  ASSERT_GE(fine.modes.eigenvalues.size(), 10);
  for (Eigen::Index m = 0; m < 10; ++m) {
    const double right = std::sqrt(coarse.modes.eigenvalues[m] / fine.modes.eigenvalues[m]) - 1;
    EXPECT_GT(right, 1e-4);
    // The constant of the estimate is fitted to straight elements.
    EXPECT_GT(errors[m], 0.7 * right) << "mode " << m << ", in truth " << right;
    EXPECT_LT(errors[m], 3 * right) << "mode " << m << ", in truth " << right;
  }
}

}  // namespace
}  // namespace carillon::precompute
