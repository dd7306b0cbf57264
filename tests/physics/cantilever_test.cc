// SPDX-License-Identifier: Apache-2.0
//
// A square bar fixed at one end against closed forms.
#include <gtest/gtest.h>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fix_nodes.h"
#include "tests/physics/mode_families.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/physics/timoshenko_beam.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kSteel{.young_pa = 210e9, .poisson_ratio = 0.3};
constexpr double kDensity = 7850;
constexpr BeamMaterial kBeamSteel{
    .young_pa = 210e9, .poisson_ratio = 0.3, .density_kg_per_m3 = 7850};
constexpr double kLength = 0.3;
constexpr double kSide = 0.02;

TetMesh Cantilever(const std::array<int, 3>& cells, int nodes_per_element) {
  TetMesh mesh = MakeTetBox({kLength, kSide, kSide}, cells, nodes_per_element);
  EXPECT_TRUE(FixNodes({FixedPlane{{0, 0, 0}, {1, 0, 0}}}, BoundarySurface(mesh), {}, mesh).ok());
  return mesh;
}

struct CantileverTest : ::testing::Test {
  static void SetUpTestSuite() {
    mesh = Cantilever({20, 4, 4}, 10);
    modes = ModesOf(mesh, kSteel, kDensity, 14'000);
  }

  static std::vector<double> Of(Family family) {
    return FrequenciesOf(family, mesh, modes, kSide / 2, kSide / 2);
  }

  static inline TetMesh mesh;
  static inline DeformationModes modes;
};

TEST_F(CantileverTest, NothingIsLeftToMoveFreely) {
  EXPECT_EQ(modes.verification.rigid_mode_count, 0);
  EXPECT_EQ(modes.verification.sturm_count, modes.modes.eigenvalues.size());
}

// Beam theory leaves a clamped section free to grow narrower; fixed as it is, the bar is a little
// stiffer: some tenths of its side shorter.
TEST_F(CantileverTest, BendsInPairsAsTimoshenkoSays) {
  const std::vector<double> bending = Of(Family::kBending);
  ASSERT_GE(bending.size(), 8u);
  const FreeBeam beam = RectangularBeam(kLength, kSide, kSide, kSteel.poisson_ratio);
  for (int order = 1; order <= 4; ++order) {
    const double expected = ClampedBendingHz(beam, kBeamSteel, order);
    const auto first = static_cast<size_t>(2 * order - 2);
    EXPECT_NEAR(bending[first] / expected, 1, 0.012) << order;
    // A square bends alike in both planes; the cells are cut along one diagonal, not both.
    EXPECT_NEAR(bending[first + 1] / bending[first], 1, 1e-3) << order;
  }
}

TEST_F(CantileverTest, TwistsAsAQuarterWaveWithSaintVenantsConstant) {
  const std::vector<double> torsion = Of(Family::kTorsional);
  ASSERT_GE(torsion.size(), 2u);
  const double shear_speed = std::sqrt(ToLame(kSteel).mu_pa / kDensity);
  // J = 0.140577 a^4 over the polar moment a^4 / 6. Fixed flat where it would warp: stiffer.
  const double speed = shear_speed * std::sqrt(0.140577 * 6);
  for (size_t n = 0; n < 2; ++n) {
    const double expected = (2 * static_cast<double>(n) + 1) * speed / (4 * kLength);
    EXPECT_NEAR(torsion[n] / expected, 1, 0.012) << n;
  }
}

TEST_F(CantileverTest, StretchesAsAQuarterWave) {
  const std::vector<double> longitudinal = Of(Family::kLongitudinal);
  ASSERT_GE(longitudinal.size(), 2u);
  const double speed = std::sqrt(kSteel.young_pa / kDensity);
  for (size_t n = 0; n < 2; ++n) {
    const double expected = (2 * static_cast<double>(n) + 1) * speed / (4 * kLength);
    // Inertia across the axis lowers the higher one by a part in a thousand (Rayleigh).
    EXPECT_NEAR(longitudinal[n] / expected, 1, 0.01) << n;
  }
}

TEST_F(CantileverTest, LumpedMassAgreesWithTheConsistent) {
  const DeformationModes lumped = ModesOf(mesh, kSteel, kDensity, 3000, MassSharing::kLumped);
  const std::vector<double> frequencies = FrequenciesHz(lumped);
  ASSERT_GE(frequencies.size(), 4u);
  for (size_t m = 0; m < 4; ++m) {
    EXPECT_NEAR(frequencies[m] / FrequenciesHz(modes)[m], 1, 0.005) << m;
  }
}

TEST_F(CantileverTest, LinearElementsConvergeToItFromAbove) {
  const double converged = FrequenciesHz(modes)[0];
  double previous = 10;  // relative error
  for (const int n : {1, 2}) {
    const TetMesh linear = Cantilever({24 * n, 2 * n, 2 * n}, 4);
    const double error = FrequenciesHz(ModesOf(linear, kSteel, kDensity, 600))[0] / converged - 1;
    EXPECT_GT(error, 0);
    EXPECT_LT(error, previous / 2);
    previous = error;
  }
}

// A metre of wire: its stiffest node is 1e12 times as stiff as its lowest mode, so that residuals
// cannot be small; its frequencies must be right, and the proof must own up to the residual.
TEST(SlenderCantilever, IsSolvedAsWellAsRoundingLetsIt) {
  constexpr double kThickness = 0.004;
  TetMesh mesh = MakeTetBox({1, kThickness, kThickness}, {250, 1, 1}, 10);
  ASSERT_TRUE(FixNodes({FixedPlane{{0, 0, 0}, {1, 0, 0}}}, BoundarySurface(mesh), {}, mesh).ok());
  const DeformationModes modes = ModesOf(mesh, kSteel, kDensity, 400);
  const FreeBeam beam = RectangularBeam(1, kThickness, kThickness, kSteel.poisson_ratio);
  ASSERT_GE(modes.modes.eigenvalues.size(), 12);
  for (int order = 1; order <= 6; ++order) {
    const auto first = static_cast<size_t>(2 * order - 2);
    // One element across is too stiff by some parts in a thousand.
    EXPECT_NEAR(FrequenciesHz(modes)[first] / ClampedBendingHz(beam, kBeamSteel, order), 1, 0.005)
        << order;
  }
  EXPECT_GT(modes.verification.max_residual, 1e-6);
  EXPECT_LT(modes.verification.max_residual, 1e-3);
}

// Tabulated wherever beams are.
TEST(ClampedBeam, SlenderOneHasTheRootsOfEuler) {
  const FreeBeam beam = RectangularBeam(10, 0.01, 0.01, 0.3);
  const double scale = std::sqrt(kBeamSteel.young_pa * beam.second_moment_m4 /
                                 (kBeamSteel.density_kg_per_m3 * beam.area_m2)) /
                       (2 * std::numbers::pi * 100);
  const std::array<double, 3> roots = {1.875104, 4.694091, 7.854757};
  for (int order = 1; order <= 3; ++order) {
    const double euler = roots[static_cast<size_t>(order - 1)];
    EXPECT_NEAR(ClampedBendingHz(beam, kBeamSteel, order) / (scale * euler * euler), 1, 1e-4);
  }
}

}  // namespace
}  // namespace carillon::precompute
