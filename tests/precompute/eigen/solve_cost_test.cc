// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/eigen/solve_cost.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "precompute/sparse/multifrontal_cholesky.h"
#include "proto/cpp/error_reason.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

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
