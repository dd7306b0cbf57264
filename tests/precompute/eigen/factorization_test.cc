// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

#include "precompute/eigen/cholesky_factor.h"
#include "precompute/sparse/node_ordering.h"
#include "tests/precompute/reference/inertia.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

struct FactorizationTest : ::testing::Test {
  SystemMatrices system =
      Assemble(MakeTetBox({1, 0.6, 0.3}, {4, 3, 2}, 4), {.young_pa = 1, .poisson_ratio = 0.3}, 1,
               MassSharing::kConsistent);
  std::vector<int> order = OrderUnknowns(system);
};

TEST_F(FactorizationTest, OrderHasEveryUnknownOnceAndKeepsNodesTogether) {
  for (size_t k = 0; k < order.size(); k += 3) {
    EXPECT_EQ(order[k] % 3, 0);
    EXPECT_EQ(order[k + 1], order[k] + 1);
    EXPECT_EQ(order[k + 2], order[k] + 2);
  }
  std::vector<int> every(static_cast<size_t>(system.unknown_count()));
  std::iota(every.begin(), every.end(), 0);
  EXPECT_THAT(order, ::testing::UnorderedElementsAreArray(every));
}

TEST_F(FactorizationTest, InertiaCountsTheEigenvaluesOfTheDenseSolution) {
  const Eigen::MatrixXd K = Eigen::MatrixXd(system.K).selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd M = Eigen::MatrixXd(system.M).selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd eigenvalues =
      Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(K, M).eigenvalues();
  for (const Eigen::Index below : {6, 7, 20, 100, 179}) {
    const double between = (eigenvalues[below - 1] + eigenvalues[below]) / 2;
    const absl::StatusOr<int> count = CountEigenvaluesBelow(system, between, order);
    ASSERT_TRUE(count.ok()) << count.status();
    EXPECT_EQ(*count, below);
  }
  EXPECT_EQ(CountEigenvaluesBelow(system, -1e-3, order).value(), 0);
  EXPECT_EQ(CountEigenvaluesBelow(system, 2 * eigenvalues.maxCoeff(), order).value(),
            system.unknown_count());
}

TEST_F(FactorizationTest, CholeskyFactorSolvesTheSystem) {
  const SystemMatrices::Sparse A = system.K + 0.5 * system.M;
  const absl::StatusOr<CholeskyFactor> factor = CholeskyFactor::Make(A, order);
  ASSERT_TRUE(factor.ok()) << factor.status();
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(A.rows(), 3);
  Eigen::MatrixXd work = b(factor->order(), Eigen::all);
  factor->SolveL(work);
  factor->SolveLTransposed(work);
  Eigen::MatrixXd x(b.rows(), b.cols());
  x(factor->order(), Eigen::all) = work;
  EXPECT_LT((A.selfadjointView<Eigen::Lower>() * x - b).norm(), 1e-11 * b.norm());
}

TEST_F(FactorizationTest, CholeskyRefusesAnIndefiniteMatrix) {
  const SystemMatrices::Sparse A = system.K - 10 * system.M;
  EXPECT_THAT(CholeskyFactor::Make(A, order).status().ToString(),
              ::testing::HasSubstr("VERIFICATION_FAILED: "));
}

SystemMatrices BoxSystem(const std::array<int, 3>& cells) {
  const TetMesh mesh = MakeTetBox({1, 1, 0.03}, cells, 4);
  return Assemble(mesh, {.young_pa = 1, .poisson_ratio = 0.3}, 1, MassSharing::kLumped);
}

TEST(OrderThinWall, OrdersEachNodeOfAPlateOnce) {
  const SystemMatrices plate = BoxSystem({24, 24, 1});
  std::vector<int> order = OrderThinWall(plate.K);
  std::ranges::sort(order);
  std::vector<int> all(static_cast<size_t>(plate.K.cols() / 3));
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(order, all);
}

TEST(OrderThinWall, LeavesThickerBodiesAlone) {
  EXPECT_TRUE(OrderThinWall(BoxSystem({24, 24, 2}).K).empty());
  EXPECT_TRUE(OrderThinWall(BoxSystem({9, 9, 9}).K).empty());
}

}  // namespace
}  // namespace carillon::precompute
