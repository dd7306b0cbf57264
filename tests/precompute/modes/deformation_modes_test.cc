// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/deformation_modes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/mesh/point_math.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

SystemMatrices AssembleUnit(const TetMesh& mesh) {
  return Assemble(mesh, kUnitElastic, 1, MassSharing::kConsistent);
}

absl::StatusOr<DeformationModes> Solve(const TetMesh& mesh, double limit) {
  return SolveDeformationModes(AssembleUnit(mesh), mesh.nodes, limit, kSilent);
}

/// All eigenvalues, rigid-body modes included.
Eigen::VectorXd AllEigenvalues(const TetMesh& mesh) {
  const SystemMatrices system = AssembleUnit(mesh);
  const auto count = static_cast<int>(system.unknown_count());
  return DenseEigensolver()
      .Solve(system, {.count = count, .eigenvalue_limit = 0}, [](double) {})
      ->eigenvalues;
}

/// A box, and the same box again beside it; both have the nodes in common that they share.
TetMesh TwoBoxes(const TetMesh& box, const Point& offset) {
  TetMesh whole = box;
  std::vector<int32_t> new_index;
  for (Point p : box.nodes) {
    for (size_t x = 0; x < 3; ++x) p[x] += offset[x];
    const auto shared =
        std::ranges::find_if(box.nodes, [&](const Point& q) { return Distance(p, q) < 1e-9; });
    new_index.push_back(static_cast<int32_t>(shared < box.nodes.end() ? shared - box.nodes.begin()
                                                                      : std::ssize(whole.nodes)));
    if (shared == box.nodes.end()) whole.nodes.push_back(p);
  }
  for (const int32_t node : box.elements) {
    whole.elements.push_back(new_index[static_cast<size_t>(node)]);
  }
  return whole;
}

struct DeformationModesTest : ::testing::TestWithParam<std::array<int, 3>> {
  TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, GetParam(), 4);
};

TEST_P(DeformationModesTest, AreAllThoseBelowTheLimitAndTheProofSaysSo) {
  const Eigen::VectorXd eigenvalues = AllEigenvalues(mesh);
  const double limit = (eigenvalues[25] + eigenvalues[26]) / 2;
  const DeformationModes result = Solve(mesh, limit).value();
  ASSERT_EQ(result.modes.eigenvalues.size(), 20);
  for (Eigen::Index m = 0; m < 20; ++m) {
    EXPECT_NEAR(result.modes.eigenvalues[m] / eigenvalues[m + 6], 1, 1e-9);
  }
  EXPECT_EQ(result.lowest_eigenvalue, result.modes.eigenvalues[0]);
  const Verification& proof = result.verification;
  EXPECT_EQ(proof.rigid_mode_count, 6);
  EXPECT_EQ(proof.sturm_count, 26);
  EXPECT_GT(proof.sturm_eigenvalue, result.modes.eigenvalues[19]);
  EXPECT_GE(result.complete_to_eigenvalue, limit);
  EXPECT_EQ(proof.max_residual, result.residuals.maxCoeff());
  EXPECT_LE(proof.max_residual, kMaxResidual);
}

// A limit that agrees with an eigenvalue to the last digit is raised until the count is certain.
TEST_P(DeformationModesTest, LimitMayCoincideWithAnEigenvalue) {
  const DeformationModes result = Solve(mesh, AllEigenvalues(mesh)[12]).value();
  EXPECT_THAT(result.modes.eigenvalues.size(), ::testing::AnyOf(6, 7));
  EXPECT_EQ(result.verification.sturm_count, 6 + result.modes.eigenvalues.size());
}

TEST_P(DeformationModesTest, LowestModeAboveTheLimitIsTold) {
  const double lowest = AllEigenvalues(mesh)[6];
  const DeformationModes result = Solve(mesh, lowest / 1e4).value();
  EXPECT_EQ(result.modes.eigenvalues.size(), 0);
  EXPECT_NEAR(result.lowest_eigenvalue / lowest, 1, 1e-9);
}

TEST_P(DeformationModesTest, BodyInTwoPiecesOrHeldTogetherByAnEdgeIsRefused) {
  for (const auto& [offset, ways] : {std::pair{Point{5, 0, 0}, "12"}, {{1, 0.6, 0}, "7"}}) {
    EXPECT_THAT(Solve(TwoBoxes(mesh, offset), 3).status().ToString(),
                HasSubstr(absl::StrCat("MESH_SEVERAL_PIECES: the body can move in ", ways,
                                       " ways without bending")));
  }
}

// The first is solved dense, the second sparse.
INSTANTIATE_TEST_SUITE_P(Cells, DeformationModesTest,
                         ::testing::Values(std::array{4, 3, 2}, std::array{9, 6, 3}));

TEST(DeformationModes, MoreThanTheStatedLimitAreRefused) {
  EXPECT_THAT(
      Solve(MakeTetBox({1, 1, 1}, {12, 12, 12}, 4), 1e9).status().ToString(),
      HasSubstr("TOO_MANY_MODES: 6585 modes lie below the top of the band; the limit is 5000; "
                "lower the band's upper frequency, or keep only the most audible modes (--keep"));
}

TEST(DeformationModes, LimitIsLoweredUntilTheMeansAllowAllModesBelowIt) {
  const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {9, 6, 3}, 4);
  const SystemMatrices system = AssembleUnit(mesh);
  const Eigen::VectorXd eigenvalues = AllEigenvalues(mesh);
  const double above_all = 2 * eigenvalues[eigenvalues.size() - 1];
  const auto result = SolveDeformationModes(system, mesh.nodes, above_all, kSilent,
                                            {.means = Means{.bytes = 1, .cpu_s = 0}})
                          .value();
  const Eigen::Index count = result.modes.eigenvalues.size();
  EXPECT_GE(count, 10);
  EXPECT_LE(count, 30);
  for (Eigen::Index m = 0; m < count; ++m) {
    EXPECT_NEAR(result.modes.eigenvalues[m] / eigenvalues[m + 6], 1, 1e-9);
  }
  EXPECT_EQ(result.verification.sturm_count, count + 6);
  EXPECT_LT(result.complete_to_eigenvalue, eigenvalues[count + 6]);
  EXPECT_GT(result.mode_count_below_asked, count);
}

TEST(DeformationModes, AmpleMeansChangeNothing) {
  const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {9, 6, 3}, 4);
  const SystemMatrices system = AssembleUnit(mesh);
  const auto plain = Solve(mesh, 40);
  const auto with_means = SolveDeformationModes(
      system, mesh.nodes, 40, kSilent, {.means = Means{.bytes = size_t{1} << 30U, .cpu_s = 60}});
  ASSERT_TRUE(plain.ok() && with_means.ok());
  EXPECT_EQ(with_means->modes.eigenvalues, plain->modes.eigenvalues);
  EXPECT_EQ(with_means->modes.shapes, plain->modes.shapes);
  EXPECT_EQ(with_means->complete_to_eigenvalue, plain->complete_to_eigenvalue);
  EXPECT_EQ(with_means->mode_count_below_asked, 0);
}

TEST(DeformationModes, TheProofIsToldApartFromTheSolution) {
  for (const std::array<int, 3>& cells : {std::array{4, 3, 2}, std::array{9, 6, 3}}) {
    const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, cells, 4);
    std::vector<SolveStage> stages;
    std::vector<SolveCost> costs;
    const auto result =
        SolveDeformationModes(AssembleUnit(mesh), mesh.nodes, 40,
                              [&](SolveStage stage, double) {
                                if (stages.empty() || stages.back() != stage)
                                  stages.push_back(stage);
                              },
                              {.on_cost = [&](const SolveCost& cost) { costs.push_back(cost); }});
    ASSERT_TRUE(result.ok()) << result.status();
    using enum SolveStage;
    // Of the first the dense solver does all at once.
    const bool dense = PrefersDense(static_cast<Eigen::Index>(3 * mesh.nodes.size()), 7);
    EXPECT_EQ(stages, dense ? std::vector({kVerify, kSolve, kVerify})
                            : std::vector({kVerify, kFactor, kSolve, kVerify}));
    ASSERT_EQ(costs.size(), 2U) << "before the modes are counted, and after";
    EXPECT_GT(costs[0].count_s, 0);
    EXPECT_EQ(costs[0].count_s, costs[1].count_s) << "the count does not depend on what it finds";
    EXPECT_GT(costs[1].solve_s, 0);
    EXPECT_EQ(costs[1].factor_s > 0, !dense);
  }
}

}  // namespace
}  // namespace carillon::precompute
