// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Bodies that are fixed: the solvers find the modes of the nodes that move.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/fem/moving_nodes.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fix_nodes.h"
#include "precompute/modes/rigid_body.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr Point kSize{1, 0.6, 0.3};

/// What is fixed at the box's corner at the origin, and how many motions are left.
struct Holding {
  const char* name;
  std::vector<Fixture> fixtures;
  int rigid_mode_count;
};

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

struct FixedBodyTest : ::testing::TestWithParam<Case> {
  TetMesh mesh = FixedBoxMesh(GetParam().holding, GetParam().cells, GetParam().nodes_per_element);
  SystemMatrices system = Assemble(mesh, kUnitElastic, 1, GetParam().mass);
  int rigid = GetParam().holding.rigid_mode_count;

  Eigen::VectorXd AllEigenvalues() const {
    const auto count = static_cast<int>(system.unknown_count());
    return DenseEigensolver()
        .Solve(system, {.count = count, .eigenvalue_limit = 0}, [](double) {})
        ->eigenvalues;
  }
};

TEST_P(FixedBodyTest, ModesAreAllThoseBelowTheLimitAndTheProofSaysSo) {
  const Eigen::VectorXd eigenvalues = AllEigenvalues();
  const double limit = (eigenvalues[rigid + 19] + eigenvalues[rigid + 20]) / 2;
  const auto result = SolveDeformationModes(system, mesh, limit, kSilent).value();
  ASSERT_EQ(result.modes.eigenvalues.size(), 20);
  for (Eigen::Index m = 0; m < 20; ++m) {
    // The dense solution is exact to rounding of the highest eigenvalue, 1e6 times the lowest.
    EXPECT_NEAR(result.modes.eigenvalues[m] / eigenvalues[m + rigid], 1, 1e-8) << m;
  }
  EXPECT_EQ(result.verification.rigid_mode_count, rigid);
  EXPECT_EQ(result.verification.sturm_count, rigid + 20);
  EXPECT_LE(result.verification.max_residual, 1e-6);
  const Eigen::MatrixXd& shapes = result.modes.shapes;
  ASSERT_EQ(shapes.rows(), 3 * static_cast<Eigen::Index>(mesh.nodes.size()));
  for (const int32_t node : mesh.fixed) {
    EXPECT_EQ(shapes.middleRows<3>(3 * Eigen::Index{node}).cwiseAbs().maxCoeff(), 0);
  }
  for (const int32_t node : MovingNodes(mesh)) {
    EXPECT_GT(shapes.middleRows<3>(3 * Eigen::Index{node}).cwiseAbs().maxCoeff(), 0);
  }
}

TEST_P(FixedBodyTest, LowestModeAboveTheLimitIsTold) {
  const double lowest = AllEigenvalues()[rigid];
  const auto result = SolveDeformationModes(system, mesh, lowest / 1e4, kSilent).value();
  EXPECT_EQ(result.modes.eigenvalues.size(), 0);
  EXPECT_NEAR(result.lowest_eigenvalue / lowest, 1, 1e-8);
}

TEST_P(FixedBodyTest, LowestEigenvalueBoundLiesAboveTheLowestModeAndNearIt) {
  const std::vector<Point> moving = PlacesOf(MovingNodes(mesh), mesh);
  const double bound = LowestEigenvalueBound(moving, system, PlacesOf(mesh.fixed, mesh));
  const double lowest = AllEigenvalues()[rigid];
  EXPECT_GT(bound, lowest * (1 - 1e-9));
  // It sets the scale of a shift, for which two decades are as good.
  EXPECT_LT(bound, 30 * lowest);
}

// Dense and block Lanczos, linear and quadratic elements, both mass matrices, all ranks.
INSTANTIATE_TEST_SUITE_P(Bodies, FixedBodyTest,
                         ::testing::Values(Case{kPoint, {4, 3, 2}, 4, MassSharing::kConsistent},
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
    // The energy of the free body, so that the motion of what is fixed would count.
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
