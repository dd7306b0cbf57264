// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/resolution.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/pipeline/graded_size.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// A round with the given element size.
Round Solved(double element_size_mm, double worst_error) {
  return {.element_size_m = 1e-3 * element_size_mm,
          .node_count = 10'000,
          .thin = true,
          .worst_error = worst_error,
          .cpu_s = 1,
          .peak_bytes = 1e8};
}

TEST(Resolution, StopsWhereTheAccuracyIsReached) {
  EXPECT_FALSE(NextElementSize({.accuracy = 0.01}, {Solved(4, 0.009)}));
}

TEST(Resolution, GoesOnAsFarAsTheErrorNeeds) {
  const auto next = NextElementSize({.accuracy = 0.01}, {Solved(4, 0.02)});
  ASSERT_TRUE(next);
  EXPECT_GT(*next, 4e-3 / 2);
  EXPECT_LT(*next, 4e-3 / 1.2);
}

TEST(Resolution, LearnsFromTwoRoundsHowFastTheErrorFalls) {
  const ResolutionGoal goal{.accuracy = 0.01};
  const auto slow = NextElementSize(goal, {Solved(8, 0.06), Solved(4, 0.02)});
  const auto fast = NextElementSize(goal, {Solved(8, 0.2), Solved(4, 0.02)});
  ASSERT_TRUE(slow && fast);
  EXPECT_LT(*slow, *fast);
}

TEST(Resolution, RefinesWallsFurtherThanSolidsInAStep) {
  Round solid = Solved(4, 0.5);
  solid.thin = false;
  const auto wall = NextElementSize({.accuracy = 0.01}, {Solved(4, 0.5)});
  const auto inside = NextElementSize({.accuracy = 0.01}, {solid});
  ASSERT_TRUE(wall && inside);
  EXPECT_LT(*wall, *inside);
}

TEST(Resolution, GivesAGradedMeshTheSizeOfTheUniformOneAndTellsWhetherItIsFiner) {
  std::vector<Round> rounds{Solved(4, 0.02), Solved(1, 0.012)};
  EXPECT_TRUE(SetEquivalentSize(3e-3, rounds));
  EXPECT_EQ(rounds.back().element_size_m, 3e-3);
  EXPECT_TRUE(NextElementSize({.accuracy = 0.01}, rounds));
  rounds.back() = Solved(1, 0.02);
  EXPECT_FALSE(SetEquivalentSize(3e-3, rounds));
}

TEST(Resolution, ForeseesTheRoundsAfterTheNextOne) {
  EXPECT_LT(LaterRounds({.accuracy = 0.01}, {Solved(4, 0.02)}), 0.2) << "the next one is the last";
  // A thin wall needs (0.5/0.008)^(2/2.4) = 31 times the nodes, of which the next round has 6.
  EXPECT_NEAR(LaterRounds({.accuracy = 0.01}, {Solved(4, 0.5)}), 6.2, 0.5);
  EXPECT_LT(LaterRounds({.accuracy = 0.01, .budget_s = 5}, {Solved(4, 0.5)}), 0.2);
}

TEST(Resolution, KeepsToItsBudgets) {
  Round dear = Solved(4, 0.5);
  dear.cpu_s = 9;
  EXPECT_FALSE(NextElementSize({.accuracy = 0.01, .budget_s = 10}, {dear}));
  EXPECT_FALSE(NextElementSize({.budget_bytes = 1e8}, {Solved(4, 0.5)}));
  const auto next = NextElementSize({.budget_s = 60}, {Solved(4, 0.5)});
  ASSERT_TRUE(next);
  EXPECT_LT(*next, 4e-3 / 1.4);
}

class GradedBar : public testing::Test {
 protected:
  /// Sizes after a mesh in which each node has the share of the error that `error_at` returns.
  template <typename ErrorAt>
  SizeField Grade(double finer, const ErrorAt& error_at) const {
    std::vector<double> errors;
    for (const Point& p : bar_.nodes) errors.push_back(error_at(p));
    return GradedSize(bar_, errors,
                      {.element_size_m = size_m_,
                       .next_element_size_m = size_m_ * finer,
                       .dimension = 3,
                       .node_growth = std::pow(finer, -3)});
  }

  TetMesh bar_ = MakeTetBox({1, 0.2, 0.2}, {20, 4, 4}, 10);
  double size_m_ = SurfaceElementSize(BoundarySurface(bar_));
};

TEST_F(GradedBar, IsUniformWhereTheErrorIs) {
  const SizeField sizes = Grade(0.5, [](const Point&) { return 3.0; });
  EXPECT_TRUE(sizes.is_uniform());
}

TEST_F(GradedBar, HasFineElementsOnlyNearTheError) {
  const SizeField sizes = Grade(0.7, [](const Point& p) { return p[0] < 0.06 ? 1.0 : 1e-3; });
  const double near = sizes.At({0, 0.1, 0.1}), far = sizes.At({1, 0.1, 0.1});
  EXPECT_NEAR(near, 1, 0.15);  // as fine as the uniform mesh, because all of the error is there
  EXPECT_GT(far, 1.2);         // 1 / 0.7 is the size of the last mesh
  EXPECT_LE(sizes.At({0.1, 0.1, 0.1}), far);
}

TEST_F(GradedBar, IsFinerByAtMostAFactorOfFour) {
  const SizeField sizes = Grade(0.9, [](const Point& p) { return p[0] == 0 ? 1.0 : 0.0; });
  const SizeField finest = Grade(0.9, [](const Point& p) { return p[0] == 0 ? 1e9 : 1.0; });
  // Relative to 0.9 of the last size, and the sizes at the nodes differ by up to a fifth.
  EXPECT_GT(sizes.At({0, 0, 0}), 0.8 * 0.25 / 0.9);
  EXPECT_GT(finest.At({0, 0, 0}), 0.8 * 0.25 / 0.9);
}

}  // namespace
}  // namespace carillon::precompute
