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

constexpr double kLength = 0.3;

/// The n-th longitudinal mode, Hz, lowered by the inertia of the section's breathing (Rayleigh and
/// Love).
double LongitudinalHz(int n, double polar_radius2_m2) {
  const double speed = std::sqrt(kSteel.young_pa / kSteelDensity);
  const double k = n * std::numbers::pi / kLength;
  const double nu = kSteel.poisson_ratio;
  return n * speed / (2 * kLength) / std::sqrt(1 + nu * nu * k * k * polar_radius2_m2);
}

/// The n-th torsional mode, Hz; `stiffness`: Saint Venant's constant over the polar moment.
double TorsionalHz(int n, double stiffness) {
  return n * std::sqrt(stiffness * ToLame(kSteel).mu_pa / kSteelDensity) / (2 * kLength);
}

TEST(SquareBar, TwistsStretchesAndBendsAsTheClosedFormsSay) {
  constexpr double kSide = 0.02;
  const TetMesh mesh = MakeTetBox({kLength, kSide, kSide}, {20, 4, 4}, 10);
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 18'000), kSide / 2, kSide / 2};
  // Saint Venant: J = 0.140577 a^4 over a^4 / 6, which four elements across give 0.4 % too stiff: a
  // mode's frequency half of that, a little more the more warping takes.
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 3, [](int n) { return TorsionalHz(n, 0.140577 * 6); }, 0.005);
  // The section breathes a little otherwise than Love has it.
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 2,
      [](int n) { return LongitudinalHz(n, kSide * kSide / 6); }, 0.0005);
  const std::vector<double> bending = bar.Of(Family::kBending);
  const FreeBeam beam = RectangularBeam(kLength, kSide, kSide, kSteel.poisson_ratio);
  ExpectSeries(
      bending, 1, 1, [&](int) { return FirstBendingHz(beam); }, 0.001);
  // The cells are cut along one diagonal of the section: the mesh is no square to the last digit.
  ExpectPairs(bending, 4, 1e-3);
}

// A round bar, meshed as any surface is.
TEST(RoundBar, TwistsStretchesAndBendsAsTheClosedFormsSay) {
  constexpr double kRadius = 0.012;
  const TetMesh mesh =
      Tetrahedralize(MakeRodSurface(kRadius, kLength, 24, 30), {.keep_surface = true}).value();
  const BarModes bar{mesh, ModesOf(mesh, kSteel, kSteelDensity, 12'000)};
  // Its torsional waves are shear waves. A polygon of 24 corners with the circle's area is stiffer
  // by some parts in ten thousand.
  ExpectSeries(
      bar.Of(Family::kTorsional), 1, 2, [](int n) { return TorsionalHz(n, 1); }, 5e-4);
  ExpectSeries(
      bar.Of(Family::kLongitudinal), 1, 1,
      [](int n) { return LongitudinalHz(n, kRadius * kRadius / 2); }, 1e-4);
  // No direction is distinguished but by the mesh, whose elements have no order at all.
  ExpectPairs(bar.Of(Family::kBending), 3, 5e-5);
}

constexpr Point kFlatBar{0.2, 0.02, 0.012};

/// Bending in the plane of the smaller height, which is the lower in pitch.
double BeamTheoryHz() {
  return FirstBendingHz(
      RectangularBeam(kFlatBar[0], kFlatBar[2], kFlatBar[1], kSteel.poisson_ratio));
}

/// The first mode over that of the theory.
double FirstMode(const TetMesh& mesh, MassSharing sharing = MassSharing::kConsistent) {
  return FrequenciesHz(ModesOf(mesh, kSteel, kSteelDensity, 5000, sharing))[0] / BeamTheoryHz();
}

TEST(FreeBar, FirstBendingModeMatchesBeamTheory) {
  const TetMesh mesh = MakeTetBox(kFlatBar, {16, 2, 2}, 10);
  // Timoshenko's theory and three dimensions differ by a few parts in ten thousand at this ratio of
  // length to height.
  EXPECT_NEAR(FirstMode(mesh), 1, 0.001);
  EXPECT_NEAR(FirstMode(mesh, MassSharing::kLumped), 1, 0.005);
}

TEST(FreeBar, LinearElementsConvergeToBeamTheoryFromAbove) {
  double previous = 10;  // relative error
  for (const int n : {1, 2, 4}) {
    const double error = FirstMode(MakeTetBox(kFlatBar, {16 * n, 2 * n, n}, 4)) - 1;
    EXPECT_GT(error, 0);
    EXPECT_LT(error, previous / 2);  // the theory: a quarter, once the mesh is fine
    previous = error;
  }
  EXPECT_LT(previous, 0.15);
}

// Twelve triangles are all that a CAD program gives for a bar: the surface must be refined, else
// the elements are as long as the bar.
TEST(FreeBar, TwelveTrianglesSuffice) {
  const TetMesh mesh = Tetrahedralize(MakeBoxSurface(kFlatBar), {}).value();
  EXPECT_NEAR(FirstMode(mesh), 1, 0.01);
}

}  // namespace
}  // namespace carillon::precompute
