// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/error_estimate.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

// The coarsest meshes are far from fine enough for linear elements.
TEST(ErrorEstimate, IsNearTheTrueErrorAndSeldomBelowIt) {
  const Point size{1, 0.4, 0.3};
  constexpr double kLimit = 60;
  const DeformationModes fine = ModesBelow(kLimit, MakeTetBox(size, {20, 8, 6}, 10));
  for (const TetMesh& mesh : {MakeTetBox(size, {12, 4, 3}, 4), MakeTetBox(size, {24, 8, 6}, 4),
                              MakeTetBox(size, {6, 3, 2}, 10), MakeTetBox(size, {12, 5, 3}, 10)}) {
    SCOPED_TRACE(mesh.nodes.size());
    const DeformationModes coarse = ModesBelow(2 * kLimit, mesh);
    ASSERT_GE(coarse.modes.eigenvalues.size(), fine.modes.eigenvalues.size());
    // Further up the coarsest mesh has other modes in between. The fine mesh has an error of its
    // own, some 1e-5.
    ExpectErrorsNearTruth(mesh, coarse, fine, 6, {.least = 0.8, .most = 3, .beside = 2e-5});
  }
}

TEST(ErrorEstimate, HasItsLargestSharesWhereElementsAreCoarse) {
  // Cells that are four times as long in the half of high x.
  TetMesh mesh = MakeTetBox({1, 0.2, 0.2}, {20, 2, 2}, 4);
  for (Point& p : mesh.nodes) p[0] = p[0] < 0.5 ? p[0] : 0.5 + 4 * (p[0] - 0.5);
  const DeformationModes solution = ModesBelow(60, mesh);
  ASSERT_GT(solution.modes.eigenvalues.size(), 0);
  const std::vector<double> at_node =
      EstimateFrequencyErrors(mesh, kUnitElastic, solution.modes).at_node;
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
  const DeformationModes fine = ModesBelow(kLimit, MakeTetSphere(1, 700, true));
  const TetMesh mesh = MakeTetSphere(1, 150, true);
  const DeformationModes coarse = ModesBelow(kLimit * 1.1, mesh);
  // The constant of the estimate is fitted to straight elements.
  ExpectErrorsNearTruth(mesh, coarse, fine, 10, {.least = 0.7, .most = 3, .least_true = 1e-4});
}

}  // namespace
}  // namespace carillon::precompute
