// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gtest/gtest.h>

#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/eigen/verification.h"
#include "precompute/modes/rigid_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

const SolveProgress kSilent = [](double) {};
constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.3};

SystemMatrices AssembleUnit(const TetMesh& mesh) {
  return Assemble(mesh, kElastic, 1, MassSharing::kConsistent);
}

TEST(RigidBodyModes, AreOrthonormalAndWithoutEnergy) {
  const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, 10);
  const SystemMatrices system = AssembleUnit(mesh);
  const Eigen::MatrixXd rigid = RigidBodyModes(mesh.nodes, system);
  EXPECT_LT(OrthogonalityError(system, rigid), 1e-13);
  EXPECT_LT((system.K.selfadjointView<Eigen::Lower>() * rigid).norm(), 1e-12);
}

TEST(LowestEigenvalueBound, LiesAboveTheLowestDeformationModeAndNearIt) {
  for (const Point& size : {Point{1, 0.6, 0.3}, Point{1, 0.05, 0.05}}) {
    const TetMesh mesh = MakeTetBox(size, {8, 2, 2}, 10);
    const SystemMatrices system = AssembleUnit(mesh);
    const Modes modes =
        DenseEigensolver().Solve(system, {.count = 7, .eigenvalue_limit = 0}, kSilent).value();
    const double bound = LowestEigenvalueBound(mesh.nodes, system);
    EXPECT_GE(bound, modes.eigenvalues[6]);
    EXPECT_LT(bound, 4 * modes.eigenvalues[6]);
  }
}

TEST(Residuals, TellAModeFromAnotherVector) {
  const SystemMatrices system = AssembleUnit(MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, 4));
  absl::StatusOr<Modes> modes =
      DenseEigensolver().Solve(system, {.count = 8, .eigenvalue_limit = 0}, kSilent);
  ASSERT_TRUE(modes.ok());
  modes->eigenvalues = modes->eigenvalues.tail(2).eval();
  modes->shapes = modes->shapes.rightCols(2).eval();
  EXPECT_LT(Residuals(system, *modes).maxCoeff(), 1e-9);
  modes->eigenvalues[1] *= 1.001;
  EXPECT_NEAR(Residuals(system, *modes)[1], 0.001, 1e-5);
}

}  // namespace
}  // namespace carillon::precompute
