// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/block_lanczos_eigensolver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/eigen/verification.h"
#include "precompute/modes/rigid_body.h"
#include "precompute/sparse/openblas.h"
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

/// The largest 1 - MAC of modes no other mode is near to.
double WorstShape(const SystemMatrices& system, const Modes& modes, const Modes& reference) {
  double worst = 0;
  const Eigen::VectorXd& values = modes.eigenvalues;
  const Eigen::MatrixXd weighted = system.M.selfadjointView<Eigen::Lower>() * reference.shapes;
  for (Eigen::Index m = 6; m + 1 < values.size(); ++m) {
    const double gap =
        std::min(values[m + 1] - values[m], m > 6 ? values[m] - values[m - 1] : 1e99);
    if (gap < 1e-2 * values[m]) continue;
    const double overlap = modes.shapes.col(m).dot(weighted.col(m));
    worst = std::max(worst, 1 - overlap * overlap);
  }
  return worst;
}

// Thin walls: a factor in float alone is not good enough, each solve must be refined.
TEST(BlockLanczos, AgreesWithTheDenseSolverOnAThinTube) {
  Body body(MakeTetTube({.wall_m = 0.0002, .length_m = 0.2, .around = 16, .along = 12}, 4),
            MassSharing::kLumped);
  const ModeRequest request{.count = 30, .eigenvalue_limit = kLimit};
  const Modes dense = DenseEigensolver().Solve(body.system, request, [](double) {}).value();
  const Modes modes = body.Solve(30);
  ExpectSameModes(body.system, modes, dense);
  // The square of an angle: residual 1e-6 over a gap of 1e-2.
  EXPECT_LT(WorstShape(body.system, modes, dense), 1e-8);
}

// The cube's largest fronts are shared among threads, the smaller ones are not.
TEST(BlockLanczos, ThreadsChangeRoundingOnly) {
  Body body(MakeTetBox({0.3, 0.28, 0.26}, {7, 7, 7}, 10), MassSharing::kConsistent);
  SetThreadCount(1);
  const Modes alone = body.Solve(30);
  SetThreadCount(3);
  const Modes together = body.Solve(30);
  SetThreadCount(1);
  ExpectSameModes(body.system, together, alone);
  EXPECT_LT(WorstShape(body.system, together, alone), 1e-8);
}

// What remains is told by it: it must not stand still while modes are refined.
TEST(BlockLanczos, ToldProgressGoesOnWhileModesAreRefined) {
  Body body(MakeTetTube({.wall_m = 0.002, .length_m = 0.3, .around = 24, .along = 24}, 4),
            MassSharing::kLumped);
  std::vector<double> told;
  ASSERT_TRUE(BlockLanczosEigensolver(body.ordered, body.rigid)
                  .Solve(body.system, {.count = 100, .eigenvalue_limit = kLimit},
                         [&](double done) { told.push_back(done); })
                  .ok());
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.front(), 0);
  for (size_t i = 1; i < told.size(); ++i) {
    EXPECT_GE(told[i], told[i - 1]);
    EXPECT_LT(told[i] - told[i - 1], 0.25);
  }
  // The last projection and its residuals are yet to come when the last correction is told.
  EXPECT_GT(told.back(), 0.8);
  EXPECT_LE(told.back(), 1);
}

TEST(BlockLanczos, GivesTheSameModesEachTime) {
  Body body(MakeTetBox({0.3, 0.05, 0.02}, {12, 3, 2}, 4), MassSharing::kLumped);
  EXPECT_EQ(body.Solve(20).shapes, body.Solve(20).shapes);
}

}  // namespace
}  // namespace carillon::precompute
