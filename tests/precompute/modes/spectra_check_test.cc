// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Spectra as a second opinion on block Lanczos.
#include "precompute/modes/spectra_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fix_nodes.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

/// A tube, whose bending modes come in pairs of one frequency, free or clamped at one end.
TetMesh TubeMesh(int nodes_per_element, bool clamped) {
  TetMesh mesh = MakeTetTube({.around = 12, .along = 20}, nodes_per_element);
  if (!clamped) return mesh;
  const absl::Status status =
      FixNodes({FixedPlane{{0, 0, 0}, {0, 0, 1}}}, BoundarySurface(mesh), {}, mesh);
  EXPECT_TRUE(status.ok()) << status;
  return mesh;
}

absl::StatusOr<DeformationModes> Solve(const SystemMatrices& system, const TetMesh& mesh) {
  return SolveDeformationModes(system, mesh, 40, kSilent);
}

struct SpectraCheckTest : ::testing::TestWithParam<std::tuple<int, MassSharing, bool>> {};

TEST_P(SpectraCheckTest, BothSolversFindTheSameModes) {
  const auto& [nodes_per_element, mass, clamped] = GetParam();
  const TetMesh mesh = TubeMesh(nodes_per_element, clamped);
  const SystemMatrices system = Assemble(mesh, kUnitElastic, 1, mass);
  const auto lanczos = Solve(system, mesh).value();
  const SpectraCheck check = CheckWithSpectra(system, mesh, lanczos);
  EXPECT_EQ(check.failure, "");
  EXPECT_GT(check.mode_count, 5);
  EXPECT_EQ(check.mode_count, check.spectra_mode_count);
  // The error of a frequency is at most the square of its relative residual, 1e-5, over the
  // relative gap to its neighbours, 1e-3.
  EXPECT_LT(check.largest_frequency_difference, 1e-7);
  // Residuals of 1e-5 over gaps of 1e-3 turn a shape by 1e-2 at most.
  EXPECT_GT(check.least_mac, 1 - 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Bodies, SpectraCheckTest,
                         ::testing::Combine(::testing::Values(4, 10),
                                            ::testing::Values(MassSharing::kConsistent,
                                                              MassSharing::kLumped),
                                            ::testing::Bool()));

TEST(SpectraCheck, CountsAModeThatTheModelLacks) {
  const TetMesh mesh = TubeMesh(4, false);
  const SystemMatrices system = Assemble(mesh, kUnitElastic, 1, MassSharing::kConsistent);
  DeformationModes fewer = *Solve(system, mesh);
  const Modes modes = fewer.modes;
  const Eigen::Index left = modes.eigenvalues.size() - 1;
  fewer.modes = {.eigenvalues = modes.eigenvalues.head(left),
                 .shapes = modes.shapes.leftCols(left)};
  const SpectraCheck check = CheckWithSpectra(system, mesh, fewer);
  EXPECT_EQ(check.mode_count, left);
  EXPECT_EQ(check.spectra_mode_count, left + 1);
}

}  // namespace
}  // namespace carillon::precompute
