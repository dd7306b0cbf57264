// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "precompute/mesh/sounding_surface.h"
#include "precompute/modes/coupling.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr double kE = 7e10;  // Young's modulus relative to 1 Pa
constexpr double kR = 2700;  // density relative to 1 kg/m^3
constexpr double kS = 0.3;   // size

constexpr std::array kCells{6, 3, 2};

/// Lambda' = Lambda e / (r s^2), phi' = phi r^(-1/2) s^(-3/2), c' = c e^(1/2) r^(-1) s^(-1/2): a
/// second decomposition of the scaled body must find what scaling the first gives.
TEST(Scaling, OfEigenvaluesShapesAndCouplingsIsThatOfASecondDecomposition) {
  const TetMesh unit_mesh = MakeTetBox({1, 0.6, 0.3}, kCells, 10);
  const TetMesh scaled_mesh = MakeTetBox({kS, 0.6 * kS, 0.3 * kS}, kCells, 10);
  const Modes unit = ModesOf(unit_mesh, {.young_pa = 1, .poisson_ratio = 0.3}, 1, 1.2).modes;
  const Modes scaled = ModesOf(scaled_mesh, {.young_pa = kE, .poisson_ratio = 0.3}, kR,
                               1.2 * std::sqrt(kE / kR) / kS)
                           .modes;
  ASSERT_GT(unit.eigenvalues.size(), 5);
  ASSERT_EQ(scaled.eigenvalues.size(), unit.eigenvalues.size());
  const Eigen::VectorXd before = Couplings(unit_mesh, MakeSoundingSurface(unit_mesh), unit);
  const Eigen::VectorXd after = Couplings(scaled_mesh, MakeSoundingSurface(scaled_mesh), scaled);
  const double factor = std::pow(kR, -0.5) * std::pow(kS, -1.5);
  for (Eigen::Index m = 0; m < unit.eigenvalues.size(); ++m) {
    EXPECT_NEAR(scaled.eigenvalues[m] / (unit.eigenvalues[m] * kE / (kR * kS * kS)), 1, 1e-8);
    EXPECT_NEAR((scaled.shapes.col(m) - factor * unit.shapes.col(m)).norm() /
                    (factor * unit.shapes.col(m).norm()),
                0, 1e-4)
        << m;
    EXPECT_NEAR(after[m] / (before[m] * std::sqrt(kE) / kR / std::sqrt(kS)), 1, 1e-4) << m;
  }
}

}  // namespace
}  // namespace carillon::precompute
