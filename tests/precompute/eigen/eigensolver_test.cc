// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/eigensolver.h"

#include <gtest/gtest.h>

#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/eigen/verification.h"
#include "precompute/modes/rigid_body.h"
#include "precompute/modes/spectra_check.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

const SolveProgress kSilent = [](double) {};
constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.3};

SystemMatrices AssembleUnit(const TetMesh& mesh) {
  return Assemble(mesh, kElastic, 1, MassSharing::kConsistent);
}

/// The modes that bend, of which `count` are wanted.
Modes SolveSparse(const SystemMatrices& system, int count, double limit) {
  const absl::StatusOr<Modes> modes =
      SolveWithSpectra(system, {.count = count, .eigenvalue_limit = limit});
  EXPECT_TRUE(modes.ok()) << modes.status();
  return *modes;
}

TEST(Eigensolver, DenseAndSparseAgree) {
  const SystemMatrices system = AssembleUnit(MakeTetBox({1, 0.6, 0.3}, {5, 3, 2}, 10));
  const absl::StatusOr<Modes> dense =
      DenseEigensolver().Solve(system, {.count = 30, .eigenvalue_limit = 0}, kSilent);
  ASSERT_TRUE(dense.ok()) << dense.status();
  const Modes sparse = SolveSparse(system, 30, dense->eigenvalues[29]);
  for (Eigen::Index m = 6; m < 30; ++m) {
    // The dense solution is exact to rounding of the highest eigenvalue, 1e6 times the lowest.
    EXPECT_NEAR(sparse.eigenvalues[m] / dense->eigenvalues[m], 1, 1e-9) << m;
    const double overlap =
        dense->shapes.col(m).dot(system.M.selfadjointView<Eigen::Lower>() * sparse.shapes.col(m));
    EXPECT_NEAR(std::abs(overlap), 1, 1e-6) << m;
  }
}

TEST(Eigensolver, SparseModesFulfilTheirDefinition) {
  const SystemMatrices system = AssembleUnit(MakeTetTube({.around = 12, .along = 20}, 10));
  Modes modes = SolveSparse(system, 26, 0.01);
  EXPECT_LT(OrthogonalityError(system, modes.shapes), 1e-10);
  modes.eigenvalues = modes.eigenvalues.tail(20).eval();
  modes.shapes = modes.shapes.rightCols(20).eval();
  EXPECT_LT(Residuals(system, modes).maxCoeff(), 1e-6);
}

// Every cell of the tube is cut alike, so that the mesh has the tube's rotations by a twelfth: its
// bending modes come in pairs of exactly one frequency, of which no solver may lose one.
TEST(Eigensolver, DegeneratePairsStayPairs) {
  const SystemMatrices system = AssembleUnit(MakeTetTube({.around = 12, .along = 20}, 4));
  const Modes modes = SolveSparse(system, 12, 0.01);
  EXPECT_NEAR(modes.eigenvalues[7] / modes.eigenvalues[6], 1, 1e-8);
  EXPECT_NEAR(modes.eigenvalues[9] / modes.eigenvalues[8], 1, 1e-8);
  EXPECT_GT(modes.eigenvalues[8] / modes.eigenvalues[7], 1.5);
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
