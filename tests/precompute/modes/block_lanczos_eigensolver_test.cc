// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/block_lanczos_eigensolver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "precompute/modes/dense_eigensolver.h"
#include "precompute/modes/node_ordering.h"
#include "precompute/modes/rigid_body.h"
#include "precompute/modes/sparse_eigensolver.h"
#include "precompute/modes/verification.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kAluminium{.young_pa = 7e10, .poisson_ratio = 0.33};
const double kLimit = std::pow(2 * std::numbers::pi * 20000, 2);

struct Body {
  Body(TetMesh tets, MassSharing sharing)
      : mesh(std::move(tets)),
        system(Assemble(mesh, kAluminium, 2700, sharing)),
        ordered(OrderedSystem::Make(system).value()),
        rigid(RigidBodyModes(mesh.nodes, system)) {}

  Modes Solve(int count) {
    return BlockLanczosEigensolver(ordered, rigid)
        .Solve(system, {.count = count, .eigenvalue_limit = kLimit}, [](double) {})
        .value();
  }

  TetMesh mesh;
  SystemMatrices system;
  OrderedSystem ordered;
  Eigen::MatrixXd rigid;
};

void ExpectSameModes(const SystemMatrices& system, const Modes& modes, const Modes& reference) {
  ASSERT_EQ(modes.eigenvalues.size(), reference.eigenvalues.size());
  for (Eigen::Index m = 6; m < modes.eigenvalues.size(); ++m) {
    // An eigenvalue errs by the square of the residual, so only rounding is left.
    EXPECT_NEAR(modes.eigenvalues[m] / reference.eigenvalues[m], 1, 1e-9) << m;
  }
  EXPECT_LT(OrthogonalityError(system, modes.shapes), 1e-11);
}

TEST(BlockLanczos, AgreesWithTheDenseSolver) {
  Body body(MakeTetBox({0.3, 0.05, 0.02}, {12, 3, 2}, 4), MassSharing::kLumped);
  const ModeRequest request{.count = 30, .eigenvalue_limit = kLimit};
  const Modes dense = DenseEigensolver().Solve(body.system, request, [](double) {}).value();
  ExpectSameModes(body.system, body.Solve(30), dense);
}

TEST(BlockLanczos, AgreesWithSpectraOnATube) {
  Body body(MakeTetTube({.around = 16, .along = 30}, 10), MassSharing::kConsistent);
  const ModeRequest request{.count = 60, .eigenvalue_limit = kLimit};
  const Modes spectra = SparseEigensolver(OrderUnknowns(body.system))
                            .Solve(body.system, request, [](double) {})
                            .value();
  ExpectSameModes(body.system, body.Solve(60), spectra);
}

TEST(BlockLanczos, LeavesSmallTrueResiduals) {
  Body body(MakeTetTube({.around = 16, .along = 30}, 10), MassSharing::kConsistent);
  const Modes all = body.Solve(60);
  const Modes deformation{.eigenvalues = all.eigenvalues.tail(54),
                          .shapes = all.shapes.rightCols(54)};
  EXPECT_LT(Residuals(body.system, deformation).maxCoeff(), 1e-6);
}

TEST(BlockLanczos, FindsBothOfEachDegeneratePair) {
  // Eight-fold symmetry: bending about two axes has one frequency.
  Body body(MakeTetTube({.length_m = 0.3, .around = 8, .along = 20}, 10), MassSharing::kConsistent);
  const Modes modes = body.Solve(12);
  EXPECT_NEAR(modes.eigenvalues[7] / modes.eigenvalues[6], 1, 2e-3);
}

TEST(BlockLanczos, GivesTheSameModesEachTime) {
  Body body(MakeTetBox({0.3, 0.05, 0.02}, {12, 3, 2}, 4), MassSharing::kLumped);
  EXPECT_EQ(body.Solve(20).shapes, body.Solve(20).shapes);
}

}  // namespace
}  // namespace carillon::precompute
