// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/deformation_modes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/fem/moving_nodes.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fix_nodes.h"
#include "precompute/mesh/point_math.h"
#include "precompute/modes/lower_limit.h"
#include "precompute/modes/rigid_body.h"
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
Eigen::VectorXd AllEigenvalues(const SystemMatrices& system) {
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

// A limit that agrees with an eigenvalue to the last digit is raised until the count is certain.
TEST_P(DeformationModesTest, LimitMayCoincideWithAnEigenvalue) {
  const DeformationModes result = Solve(mesh, AllEigenvalues(AssembleUnit(mesh))[12]).value();
  EXPECT_THAT(result.modes.eigenvalues.size(), ::testing::AnyOf(6, 7));
  EXPECT_EQ(result.verification.sturm_count, 6 + result.modes.eigenvalues.size());
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
  const Eigen::VectorXd eigenvalues = AllEigenvalues(system);
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

/// A body of which `factor * limit ^ power` eigenvalues lie below a limit, and `all` at most.
struct Body {
  double factor, power;
  int all;
  int counts = 0;

  absl::StatusOr<int> CountBelow(double limit) {
    ++counts;
    return static_cast<int>(std::min<double>(factor * std::pow(limit, power), all));
  }
};

// A solid, a wall, a wall whose limit was expected to be a solid's, a mesh all of whose modes lie
// below the limit, and a solid of fewer modes.
TEST(LowerLimit, LeavesAsManyModesAsAreAllowed) {
  const int asked = 200'000;
  for (Body body : {Body{0.2, 1.5, 1 << 30}, Body{2000, 0.5, 1 << 30}, Body{20, 1, 1 << 30},
                    Body{0.2, 1.5, 30'000}, Body{0.02, 1.5, 1 << 30}}) {
    SCOPED_TRACE(body.factor);
    const auto found =
        LowerLimit({.limit = 1e4, .count = asked, .asked_count = asked}, 1000, [&](double limit) {
          return body.CountBelow(limit);
        }).value();
    EXPECT_LE(found.count, 1000);
    EXPECT_GE(found.count, 500);
    EXPECT_EQ(found.count, *body.CountBelow(found.limit));
    EXPECT_EQ(found.asked_count, asked);
    EXPECT_LE(body.counts, 9);
  }
}

TEST(LowerLimit, ReturnsTheErrorOfACount) {
  const auto found = LowerLimit({.limit = 1, .count = 100, .asked_count = 100}, 10,
                                [](double) { return absl::InternalError("on an eigenvalue"); });
  EXPECT_EQ(found.status().message(), "on an eigenvalue");
}

TEST(LargestThat, IsTheLeastWhereNoneFits) {
  EXPECT_EQ(LargestThat(36, 5006, [](int count) { return count <= 700; }), 700);
  EXPECT_EQ(LargestThat(36, 5006, [](int) { return false; }), 36);
  EXPECT_EQ(LargestThat(36, 5006, [](int) { return true; }), 5006);
}

constexpr Point kSize{1, 0.6, 0.3};

/// The fixed nodes of a box, and the number of rigid motions that are left.
struct Holding {
  const char* name;
  std::vector<Fixture> fixtures;
  int rigid_mode_count;
};

const Holding kFree{"Free", {}, 6};
const Holding kPoint{"Point", {FixedBox{{0, 0, 0}, {0, 0, 0}}}, 3};
const Holding kTwoPoints{"TwoPoints", {FixedBox{{0, 0, 0}, {0, 0, 0}}, FixedBox{kSize, kSize}}, 1};
const Holding kLine{"Line", {FixedBox{{0, 0, 0}, {1, 0, 0}}}, 1};
const Holding kFace{"Face", {FixedPlane{{0, 0, 0}, {2, 0, 0}}}, 0};
const Holding kMiddle{"Middle", {FixedBox{{0.3, 0, 0}, {0.7, 1, 1}}}, 0};

TetMesh FixedBoxMesh(const Holding& holding, const std::array<int, 3>& cells, int nodes) {
  TetMesh mesh = MakeTetBox(kSize, cells, nodes);
  const absl::Status status = FixNodes(holding.fixtures, BoundarySurface(mesh), {}, mesh);
  EXPECT_TRUE(status.ok()) << status;
  return mesh;
}

struct Case {
  Holding holding;
  std::array<int, 3> cells;
  int nodes_per_element;
  MassSharing mass;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.holding.name << c.cells[0] << "x" << c.nodes_per_element
       << (c.mass == MassSharing::kLumped ? "lumped" : "consistent");
}

struct HeldBodyTest : ::testing::TestWithParam<Case> {
  TetMesh mesh = FixedBoxMesh(GetParam().holding, GetParam().cells, GetParam().nodes_per_element);
  SystemMatrices system = Assemble(mesh, kUnitElastic, 1, GetParam().mass);
  int rigid = GetParam().holding.rigid_mode_count;
  // The dense solution is exact to rounding of the highest eigenvalue, which is 1e6 times the
  // lowest one of a body that is fixed.
  double tolerance = mesh.fixed.empty() ? 1e-9 : 1e-8;
};

TEST_P(HeldBodyTest, ModesAreAllThoseBelowTheLimitAndTheProofSaysSo) {
  const Eigen::VectorXd eigenvalues = AllEigenvalues(system);
  const double limit = (eigenvalues[rigid + 19] + eigenvalues[rigid + 20]) / 2;
  const auto result = SolveDeformationModes(system, mesh, limit, kSilent).value();
  ASSERT_EQ(result.modes.eigenvalues.size(), 20);
  for (Eigen::Index m = 0; m < 20; ++m) {
    EXPECT_NEAR(result.modes.eigenvalues[m] / eigenvalues[m + rigid], 1, tolerance) << m;
  }
  EXPECT_EQ(result.lowest_eigenvalue, result.modes.eigenvalues[0]);
  const Verification& proof = result.verification;
  EXPECT_EQ(proof.rigid_mode_count, rigid);
  EXPECT_EQ(proof.sturm_count, rigid + 20);
  EXPECT_GT(proof.sturm_eigenvalue, result.modes.eigenvalues[19]);
  EXPECT_GE(result.complete_to_eigenvalue, limit);
  EXPECT_EQ(proof.max_residual, result.residuals.maxCoeff());
  EXPECT_LE(proof.max_residual, 1e-6);
  const Eigen::MatrixXd& shapes = result.modes.shapes;
  ASSERT_EQ(shapes.rows(), 3 * static_cast<Eigen::Index>(mesh.nodes.size()));
  for (const int32_t node : mesh.fixed) {
    EXPECT_EQ(shapes.middleRows<3>(3 * Eigen::Index{node}).cwiseAbs().maxCoeff(), 0);
  }
  for (const int32_t node : MovingNodes(mesh)) {
    EXPECT_GT(shapes.middleRows<3>(3 * Eigen::Index{node}).cwiseAbs().maxCoeff(), 0);
  }
}

TEST_P(HeldBodyTest, LowestModeAboveTheLimitIsTold) {
  const double lowest = AllEigenvalues(system)[rigid];
  const auto result = SolveDeformationModes(system, mesh, lowest / 1e4, kSilent).value();
  EXPECT_EQ(result.modes.eigenvalues.size(), 0);
  EXPECT_NEAR(result.lowest_eigenvalue / lowest, 1, tolerance);
}

TEST_P(HeldBodyTest, LowestEigenvalueBoundLiesAboveTheLowestModeAndNearIt) {
  const std::vector<Point> moving = PlacesOf(MovingNodes(mesh), mesh);
  const double bound = LowestEigenvalueBound(moving, system, PlacesOf(mesh.fixed, mesh));
  const double lowest = AllEigenvalues(system)[rigid];
  EXPECT_GT(bound, lowest * (1 - 1e-9));
  // It sets the scale of a shift, for which two decades are as good.
  EXPECT_LT(bound, 30 * lowest);
}

// Dense and block Lanczos, linear and quadratic elements, both mass matrices, all ranks.
INSTANTIATE_TEST_SUITE_P(Bodies, HeldBodyTest,
                         ::testing::Values(Case{kFree, {4, 3, 2}, 4, MassSharing::kConsistent},
                                           Case{kFree, {9, 6, 3}, 4, MassSharing::kConsistent},
                                           Case{kPoint, {4, 3, 2}, 4, MassSharing::kConsistent},
                                           Case{kPoint, {8, 5, 3}, 4, MassSharing::kLumped},
                                           Case{kTwoPoints, {4, 3, 2}, 4, MassSharing::kConsistent},
                                           Case{kLine, {4, 3, 2}, 4, MassSharing::kLumped},
                                           Case{kLine, {4, 3, 2}, 10, MassSharing::kConsistent},
                                           Case{kFace, {4, 3, 2}, 4, MassSharing::kConsistent},
                                           Case{kFace, {8, 5, 3}, 4, MassSharing::kLumped},
                                           Case{kFace, {4, 3, 2}, 10, MassSharing::kConsistent},
                                           Case{kFace, {4, 3, 2}, 10, MassSharing::kLumped},
                                           Case{kMiddle, {10, 4, 2}, 4, MassSharing::kConsistent}));

TEST(FixedBody, RigidBodyModesLeaveWhatIsFixedWhereItIsAndBendNothing) {
  for (const Holding& holding : {kPoint, kTwoPoints, kLine, kFace}) {
    const TetMesh mesh = FixedBoxMesh(holding, {4, 3, 2}, 4);
    const SystemMatrices system = Assemble(mesh, kUnitElastic, 1, MassSharing::kConsistent);
    const std::vector<int32_t> moving = MovingNodes(mesh);
    const Eigen::MatrixXd rigid =
        RigidBodyModes(PlacesOf(moving, mesh), system, PlacesOf(mesh.fixed, mesh));
    ASSERT_EQ(rigid.cols(), holding.rigid_mode_count) << holding.name;
    if (rigid.cols() == 0) continue;
    // The energy is that of the free body, in which a motion of fixed nodes would count.
    TetMesh free = mesh;
    free.fixed.clear();
    const SystemMatrices whole = Assemble(free, kUnitElastic, 1, MassSharing::kConsistent);
    const Eigen::MatrixXd motion = Extended(rigid, moving, mesh.nodes.size());
    const Eigen::MatrixXd energy =
        motion.transpose() * (whole.K.selfadjointView<Eigen::Lower>() * motion);
    EXPECT_LT(energy.cwiseAbs().maxCoeff(), 1e-12) << holding.name;
  }
}

// Where a body is clamped there is a singularity of stress, which costs accuracy: more than the
// estimate says is not there.
TEST(FixedBody, ErrorOfEachModeIsEstimated) {
  const TetMesh mesh = FixedBoxMesh(kFace, {4, 2, 1}, 10);
  const DeformationModes coarse = ModesBelow(20, mesh);
  const DeformationModes fine = ModesBelow(20, FixedBoxMesh(kFace, {16, 10, 5}, 10));
  ExpectErrorsNearTruth(mesh, coarse, fine, 5, {.least = 0.5, .most = 3});
}

}  // namespace
}  // namespace carillon::precompute
