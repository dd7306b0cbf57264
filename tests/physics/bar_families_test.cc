// SPDX-License-Identifier: Apache-2.0
//
// Bars with free ends: each family of modes, told apart by its shapes, against its closed form.
#include <gtest/gtest.h>

#include "precompute/mesh/fill/tetrahedralize.h"
#include "tests/physics/mode_families.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/physics/timoshenko_beam.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kSteel{.young_pa = 210e9, .poisson_ratio = 0.3};
constexpr double kDensity = 7850;
constexpr double kLength = 0.3;

/// The n-th longitudinal mode, Hz, lowered by the inertia of the section's breathing (Rayleigh and
/// Love).
double LongitudinalHz(int n, double polar_radius2_m2) {
  const double speed = std::sqrt(kSteel.young_pa / kDensity);
  const double k = n * std::numbers::pi / kLength;
  const double nu = kSteel.poisson_ratio;
  return n * speed / (2 * kLength) / std::sqrt(1 + nu * nu * k * k * polar_radius2_m2);
}

/// The n-th torsional mode, Hz; `stiffness`: Saint Venant's constant over the polar moment.
double TorsionalHz(int n, double stiffness) {
  return n * std::sqrt(stiffness * ToLame(kSteel).mu_pa / kDensity) / (2 * kLength);
}

struct SquareBarTest : ::testing::Test {
  static constexpr double kSide = 0.02;

  static void SetUpTestSuite() {
    mesh = MakeTetBox({kLength, kSide, kSide}, {20, 4, 4}, 10);
    modes = ModesOf(mesh, kSteel, kDensity, 18'000);
  }
  static std::vector<double> Of(Family family) {
    return FrequenciesOf(family, mesh, modes, kSide / 2, kSide / 2);
  }

  static inline TetMesh mesh;
  static inline DeformationModes modes;
};

TEST_F(SquareBarTest, TwistsWithSaintVenantsConstant) {
  const std::vector<double> torsion = Of(Family::kTorsional);
  ASSERT_GE(torsion.size(), 3u);
  for (int n = 1; n <= 3; ++n) {
    // J = 0.140577 a^4 over a^4 / 6, which four elements across give 0.4 % too stiff: a mode's
    // frequency half of that, a little more the more warping takes.
    EXPECT_NEAR(torsion[static_cast<size_t>(n - 1)] / TorsionalHz(n, 0.140577 * 6), 1, 0.005) << n;
  }
}

TEST_F(SquareBarTest, StretchesAsAHalfWave) {
  const std::vector<double> longitudinal = Of(Family::kLongitudinal);
  ASSERT_GE(longitudinal.size(), 2u);
  for (int n = 1; n <= 2; ++n) {
    // The section breathes a little otherwise than Love has it.
    EXPECT_NEAR(longitudinal[static_cast<size_t>(n - 1)] / LongitudinalHz(n, kSide * kSide / 6), 1,
                0.0005)
        << n;
  }
}

TEST_F(SquareBarTest, BendsInPairs) {
  const std::vector<double> bending = Of(Family::kBending);
  ASSERT_GE(bending.size(), 8u);
  const double expected =
      FirstBendingHz(RectangularBeam(kLength, kSide, kSide, kSteel.poisson_ratio),
                     {.young_pa = kSteel.young_pa,
                      .poisson_ratio = kSteel.poisson_ratio,
                      .density_kg_per_m3 = kDensity});
  EXPECT_NEAR(bending[0] / expected, 1, 0.001);
  for (size_t m = 0; m < 8; m += 2) {
    // The cells are cut along one diagonal of the section: the mesh is no square to the last digit.
    EXPECT_NEAR(bending[m + 1] / bending[m], 1, 1e-3) << m;
  }
}

/// A round bar, meshed as any surface is.
struct RoundBarTest : ::testing::Test {
  static constexpr double kRadius = 0.012;

  static void SetUpTestSuite() {
    mesh = Tetrahedralize(MakeRodSurface(kRadius, kLength, 24, 30), {.keep_surface = true}).value();
    modes = ModesOf(mesh, kSteel, kDensity, 12'000);
  }
  static std::vector<double> Of(Family family) { return FrequenciesOf(family, mesh, modes, 0, 0); }

  static inline TetMesh mesh;
  static inline DeformationModes modes;
};

// Its torsional waves are shear waves. A polygon of 24 corners with the circle's area is stiffer by
// some parts in ten thousand.
TEST_F(RoundBarTest, TwistsAtTheSpeedOfShearWaves) {
  const std::vector<double> torsion = Of(Family::kTorsional);
  ASSERT_GE(torsion.size(), 2u);
  for (int n = 1; n <= 2; ++n) {
    EXPECT_NEAR(torsion[static_cast<size_t>(n - 1)] / TorsionalHz(n, 1), 1, 5e-4) << n;
  }
}

TEST_F(RoundBarTest, StretchesAsAHalfWave) {
  const std::vector<double> longitudinal = Of(Family::kLongitudinal);
  ASSERT_GE(longitudinal.size(), 1u);
  EXPECT_NEAR(longitudinal[0] / LongitudinalHz(1, kRadius * kRadius / 2), 1, 1e-4);
}

// No direction is distinguished but by the mesh, whose elements have no order at all.
TEST_F(RoundBarTest, BendsInPairs) {
  const std::vector<double> bending = Of(Family::kBending);
  ASSERT_GE(bending.size(), 6u);
  for (size_t m = 0; m < 6; m += 2) EXPECT_NEAR(bending[m + 1] / bending[m], 1, 5e-5) << m;
}

}  // namespace
}  // namespace carillon::precompute
