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

constexpr double kLength = 0.3;
constexpr double kSide = 0.02;

TetMesh FixedAtOneEnd(const Point& size, const std::array<int, 3>& cells) {
  TetMesh mesh = MakeTetBox(size, cells, 10);
  EXPECT_TRUE(FixNodes({FixedPlane{{0, 0, 0}, {1, 0, 0}}}, BoundarySurface(mesh), {}, mesh).ok());
  return mesh;
}

/// The n-th frequency of quarter waves of this speed.
double QuarterWaveHz(int n, double speed) { return (2 * n - 1) * speed / (4 * kLength); }

TEST(Cantilever, BendsTwistsAndStretchesAsTheClosedFormsSay) {
  const TetMesh mesh = FixedAtOneEnd({kLength, kSide, kSide}, {20, 4, 4});
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 14'000), kSide / 2, kSide / 2};
  EXPECT_EQ(bar.modes.verification.rigid_mode_count, 0);
  EXPECT_EQ(bar.modes.verification.sturm_count, bar.modes.modes.eigenvalues.size());
  // Beam theory lets a clamped section grow narrower. Here the section is fixed, so that the bar is
  // as stiff as one that is shorter by some tenths of its side.
  const FreeBeam beam = RectangularBeam(kLength, kSide, kSide, kSteel.poisson_ratio);
  const std::vector<double> bending = bar.Of(Family::kBending);
  ExpectSeries(
      bending, 2, 4, [&](int n) { return ClampedBendingHz(beam, n); }, 0.012);
  // A square bends alike in both planes; the cells are cut along one diagonal, not both.
  ExpectPairs(bending, 4, 1e-3);
  // Saint Venant: J = 0.140577 a^4 over the polar moment a^4 / 6. Fixed flat where it would warp:
  // stiffer.
  const double twist_speed = std::sqrt(ToLame(kSteel).mu_pa / kSteelDensity * 0.140577 * 6);
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 2, [&](int n) { return QuarterWaveHz(n, twist_speed); },
      0.012);
  // Inertia across the axis lowers the higher one by a part in a thousand (Rayleigh).
  const double stretch_speed = std::sqrt(kSteel.young_pa / kSteelDensity);
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 2, [&](int n) { return QuarterWaveHz(n, stretch_speed); },
      0.01);
}

// A metre of wire: its stiffest node is 1e12 times as stiff as its lowest mode, so that residuals
// cannot be small; its frequencies must be right, and the proof must own up to the residual.
TEST(SlenderCantilever, IsSolvedAsWellAsRoundingLetsIt) {
  constexpr double kThickness = 0.004;
  const TetMesh mesh = FixedAtOneEnd({1, kThickness, kThickness}, {250, 1, 1});
  const DeformationModes modes = ModesOf(mesh, kSteel, kSteelDensity, 400);
  const FreeBeam beam = RectangularBeam(1, kThickness, kThickness, kSteel.poisson_ratio);
  // One element across is too stiff by some parts in a thousand.
  ExpectSeries(
      FrequenciesHz(modes), 2, 6, [&](int n) { return ClampedBendingHz(beam, n); }, 0.005);
  EXPECT_GT(modes.verification.max_residual, 1e-6);
  EXPECT_LT(modes.verification.max_residual, 1e-3);
}

// Tabulated wherever beams are.
TEST(ClampedBeam, SlenderOneHasTheRootsOfEuler) {
  const FreeBeam beam = RectangularBeam(10, 0.01, 0.01, 0.3);
  const double scale =
      std::sqrt(kSteel.young_pa * beam.second_moment_m4 / (kSteelDensity * beam.area_m2)) /
      (2 * std::numbers::pi * 100);
  const std::array<double, 3> roots = {1.875104, 4.694091, 7.854757};
  for (int order = 1; order <= 3; ++order) {
    const double euler = roots[static_cast<size_t>(order - 1)];
    EXPECT_NEAR(ClampedBendingHz(beam, order) / (scale * euler * euler), 1, 1e-4);
  }
}

}  // namespace
}  // namespace carillon::precompute
