// SPDX-License-Identifier: AGPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "precompute/eigen/block_lanczos_eigensolver.h"
#include "precompute/eigen/dense_eigensolver.h"
#include "precompute/eigen/solve_cost.h"
#include "precompute/eigen/verification.h"
#include "precompute/modes/rigid_body.h"
#include "precompute/sparse/multifrontal_cholesky.h"
#include "precompute/sparse/openblas.h"
#include "proto/cpp/error_reason.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

const SolveProgress kSilent = [](double) {};
constexpr ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.3};

Measurement MeasureAsAssembled(const SystemMatrices& system, const Modes& modes) {
  std::vector<int32_t> order(static_cast<size_t>(system.unknown_count() / 3));
  std::iota(order.begin(), order.end(), 0);
  Workers alone(1);
  return Measure(MakeNodeMatrix(system.K, system.M, order), order, modes, alone);
}

double OrthogonalityErrorOf(const SystemMatrices& system, const Modes& modes) {
  return OrthogonalityError(MeasureAsAssembled(system, modes).gram);
}

SystemMatrices AssembleUnit(const TetMesh& mesh) {
  return Assemble(mesh, kElastic, 1, MassSharing::kConsistent);
}

TEST(RigidBodyModes, AreOrthonormalAndWithoutEnergy) {
  const TetMesh mesh = MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, 10);
  const SystemMatrices system = AssembleUnit(mesh);
  const Eigen::MatrixXd rigid = RigidBodyModes(mesh.nodes, system);
  const Eigen::VectorXd none = Eigen::VectorXd::Ones(rigid.cols());
  EXPECT_LT(OrthogonalityErrorOf(system, {.eigenvalues = none, .shapes = rigid}), 1e-13);
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

TEST(Measure, TellsAModeFromAnotherVector) {
  const SystemMatrices system = AssembleUnit(MakeTetBox({1, 0.6, 0.3}, {3, 2, 2}, 4));
  absl::StatusOr<Modes> modes =
      DenseEigensolver().Solve(system, {.count = 8, .eigenvalue_limit = 0}, kSilent);
  ASSERT_TRUE(modes.ok());
  modes->eigenvalues = modes->eigenvalues.tail(2).eval();
  modes->shapes = modes->shapes.rightCols(2).eval();
  EXPECT_LT(MeasureAsAssembled(system, *modes).residuals.maxCoeff(), 1e-9);
  modes->eigenvalues[1] *= 1.001;
  EXPECT_NEAR(MeasureAsAssembled(system, *modes).residuals[1], 0.001, 1e-5);
}

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
  EXPECT_LT(OrthogonalityErrorOf(system, modes), 1e-11);
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

OrderedSystem Cube(int cells) {
  const TetMesh mesh = MakeTetBox({1, 1, 1}, {cells, cells, cells}, 4);
  return OrderedSystem::Make(
             Assemble(mesh, {.young_pa = 1, .poisson_ratio = 0.3}, 1, MassSharing::kLumped))
      .value();
}

TEST(SolveCost, FactorIsAsLargeAsForetold) {
  const OrderedSystem ordered = Cube(6);
  Workers workers(1);
  const auto factor = MultifrontalCholesky<float>::Factorize(ordered.fronts, ordered.matrix, -0.01,
                                                             workers, nullptr)
                          .value();
  EXPECT_EQ(factor.stored_bytes(), FactorNumbers(ordered.fronts) * sizeof(float));
  EXPECT_GT(PredictSolveCost(ordered, 20, 1).peak_bytes, factor.stored_bytes());
}

TEST(SolveCost, GrowsWithModesAndFasterThanTheMesh) {
  const OrderedSystem coarse = Cube(6);
  const OrderedSystem fine = Cube(12);
  EXPECT_GT(PredictSolveCost(coarse, 100, 1).peak_bytes,
            PredictSolveCost(coarse, 50, 1).peak_bytes);
  // Nested dissection of a solid: time as the square of the nodes, 6.4 times as many here.
  EXPECT_GT(PredictSolveCost(fine, 50, 1).cpu_seconds(),
            6.4 * PredictSolveCost(coarse, 50, 1).cpu_seconds());
}

TEST(SolveCost, WhatTheMachineLacksIsRefusedWithFigures) {
  EXPECT_TRUE(CheckMemory({.peak_bytes = 1 << 20}).ok());
  const absl::Status status = CheckMemory({.peak_bytes = size_t{1} << 50});
  EXPECT_EQ(ToErrorInfo(status).reason(), "MEMORY_TOO_SMALL");
  EXPECT_EQ(ToErrorInfo(status).metadata().at("needed_bytes"), "1125899906842624");
}

TEST(SolveCost, MatricesThatAreThereAlreadyAreNotAskedForAgain) {
  constexpr size_t kMuch = size_t{1} << 50;
  EXPECT_TRUE(CheckMemory({.peak_bytes = kMuch + (1 << 20), .matrix_bytes = kMuch}).ok());
}

}  // namespace
}  // namespace carillon::precompute
