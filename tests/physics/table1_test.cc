// SPDX-License-Identifier: Apache-2.0
//
// What Table 1 of O'Brien, Shen, Gatchalian 2002 says of damping and of rows that share a shape.
#include <gtest/gtest.h>

#include <numbers>

#include "precompute/fem/elastic_constants.h"
#include "precompute/mesh/sounding_surface.h"
#include "precompute/modes/coupling.h"
#include "precompute/pipeline/intended_use.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

struct Row {
  const char* example;
  double lambda_pa, mu_pa, alpha1_s, alpha2_per_s, density_kg_per_m3;
  double base_hz, decay_per_s;  ///< as printed; the frequency is a damped one
};

/// The row of the metal bunny repeats the frequency of the ceramic one and is left out; the printed
/// decay of the boxes, 49.0, contradicts the row's own figures, which give 29.0. The last digit of
/// the chime's is rounded away: 0.68 is printed 0.6.
constexpr Row kRows[] = {
    {"chime", 4.98e10, 2.57e10, 1e-7, 0, 2700, 587.4, 0.68},
    {"bowl 1", 4.98e9, 2.57e9, 1e-7, 30, 2700, 551.3, 15.6},
    {"bowl 2", 5e8, 1e8, 8e-6, 30, 750, 216.7, 22.4},
    {"bunny, ceramic", 3.99e9, 2.05e9, 1e-6, 10, 2700, 855.9, 19.5},
    {"shelf, plastic", 2.49e10, 1.28e10, 1e-6, 50, 2700, 488.9, 29.7},
    {"shelf, aluminum", 4.98e10, 2.56e10, 1e-7, 0, 2700, 691.5, 0.9},
    {"shelf, wood", 5e8, 1e8, 8e-6, 50, 750, 154.6, 28.8},
    {"blocks", 5e8, 1e8, 8e-6, 50, 550, 1596.2, 428.1},
    {"boxes", 5e8, 1e8, 8e-6, 50, 550, 159.1, 29.0},
    {"T of The End", 1.49e9, 7.7e8, 2e-7, 30, 2700, 247.7, 15.2},
};

IntendedUse UseOf(const Row& row, double size = 1) {
  const double lambda_pa = row.lambda_pa, mu_pa = row.mu_pa;
  return {.young_pa = mu_pa * (3 * lambda_pa + 2 * mu_pa) / (lambda_pa + mu_pa),
          .density_kg_per_m3 = row.density_kg_per_m3,
          .alpha1_s = row.alpha1_s,
          .alpha2_per_s = row.alpha2_per_s,
          .size = size};
}

double DampedFrequencyHz(const IntendedUse& use, double unit_eigenvalue) {
  return use.DampedFrequencyHz(unit_eigenvalue, use.DecayRatePerS(unit_eigenvalue));
}

/// The unit eigenvalue whose damped frequency in this use is `hz`.
double UnitEigenvalueOfDamped(const IntendedUse& use, double hz) {
  double low = use.UnitEigenvalue(hz);
  double high = 1.5 * low;
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (DampedFrequencyHz(use, middle) < hz ? low : high) = middle;
  }
  return low;
}

TEST(Table1, DecayOfEveryRowFollowsFromItsFrequency) {
  for (const Row& row : kRows) {
    const IntendedUse use = UseOf(row);
    const double decay = use.DecayRatePerS(UnitEigenvalueOfDamped(use, row.base_hz));
    EXPECT_NEAR(decay, row.decay_per_s, 0.051) << row.example;  // one digit behind the point
  }
}

// Plastic and aluminum shelf differ by a factor of two in stiffness, at one density and shape. The
// frequencies printed are damped, which changes them by less than a tenth of a per cent.
TEST(Table1, AluminumShelfIsHigherThanThePlasticByTheRootOfTwo) {
  const IntendedUse plastic = UseOf(kRows[4]);
  const IntendedUse aluminum = UseOf(kRows[5]);
  EXPECT_NEAR(aluminum.FrequencyHz(1) / plastic.FrequencyHz(1), std::numbers::sqrt2, 1e-4);
  EXPECT_NEAR(kRows[5].base_hz / kRows[4].base_hz, std::numbers::sqrt2, 2e-3);
}

TEST(Table1, BoxesAreBlocksOfTenTimesTheSize) {
  const IntendedUse blocks = UseOf(kRows[7]);
  const IntendedUse boxes = UseOf(kRows[8], 10);
  EXPECT_NEAR(blocks.FrequencyHz(1) / boxes.FrequencyHz(1), 10, 1e-12);
  const double eigenvalue = UnitEigenvalueOfDamped(blocks, kRows[7].base_hz);
  EXPECT_NEAR(DampedFrequencyHz(boxes, eigenvalue), kRows[8].base_hz,
              0.9);  // the shapes' own meshes
  EXPECT_NEAR(kRows[7].base_hz / kRows[8].base_hz, 10.03, 0.005);
}

TEST(IntendedUse, OverdampedModeHasNoDampedFrequency) {
  const IntendedUse use{.young_pa = 1, .density_kg_per_m3 = 1, .alpha1_s = 0, .alpha2_per_s = 3};
  EXPECT_EQ(DampedFrequencyHz(use, 2), 0);
  EXPECT_EQ(use.DecayRatePerS(2), 1.5);
  EXPECT_NEAR(DampedFrequencyHz(use, 2.5) * 2 * std::numbers::pi, 0.5, 1e-12);
}

TEST(IntendedUse, UnitEigenvalueInvertsFrequency) {
  const IntendedUse use{.young_pa = 7e10, .density_kg_per_m3 = 2700, .size = 0.1};
  EXPECT_NEAR(use.FrequencyHz(use.UnitEigenvalue(440)), 440, 1e-10);
}

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
