// SPDX-License-Identifier: Apache-2.0
//
// Thin free bodies: a ring of square section, which bends in its plane and out of it, and a square
// plate.
#include <gtest/gtest.h>

#include <array>

#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr double kRadius = 0.05;
constexpr double kSide = 0.002;

/// sqrt(E I / (rho A R^4)), 1/s
double Scale() {
  return std::sqrt(kSteel.young_pa / kSteelDensity / 12) * kSide / (kRadius * kRadius);
}

/// n(n^2 - 1) / sqrt(n^2 + 1) of the scale (Hoppe 1871).
double InPlaneHz(int n) {
  return Scale() * n * (n * n - 1) / std::sqrt(n * n + 1.0) / (2 * std::numbers::pi);
}

/// n(n^2 - 1) / sqrt(n^2 + EI / GJ) of the scale (Michell 1889); Saint Venant's J of a square.
double OutOfPlaneHz(int n) {
  const double bending_to_twisting = 2 * (1 + kSteel.poisson_ratio) / (12 * 0.140577);
  return Scale() * n * (n * n - 1) / std::sqrt(n * n + bending_to_twisting) /
         (2 * std::numbers::pi);
}

/// Frequencies of the modes of which more than half is, or is not, along the axis.
std::vector<double> FrequenciesOf(const DeformationModes& modes, bool in_plane) {
  std::vector<double> result;
  const std::vector<double> all = FrequenciesHz(modes);
  for (size_t m = 0; m < all.size(); ++m) {
    const auto shape = modes.modes.shapes.col(static_cast<Eigen::Index>(m));
    double along_axis = 0;
    for (Eigen::Index i = 2; i < shape.size(); i += 3) along_axis += shape[i] * shape[i];
    if ((along_axis < shape.squaredNorm() / 2) == in_plane) result.push_back(all[m]);
  }
  return result;
}

TEST(Ring, BendsInPairsAsHoppeAndMichellSay) {
  const TetMesh mesh = MakeTetTube({.outer_radius_m = kRadius + kSide / 2,
                                    .wall_m = kSide,
                                    .length_m = kSide,
                                    .around = 72,
                                    .along = 2,
                                    .through = 2},
                                   10);
  const DeformationModes modes = ModesOf(mesh, kSteel, kSteelDensity, 1.2 * InPlaneHz(4));
  const std::vector<double> in_plane = FrequenciesOf(modes, true);
  const std::vector<double> out_of_plane = FrequenciesOf(modes, false);
  // Shear and rotary inertia cost the square of n times the thickness over the radius, 0.04; a
  // polygon of 72 sides is shorter around than the circle by 3e-4.
  ExpectSeries(
      in_plane, 2, 3, [](int k) { return InPlaneHz(k + 1); }, 0.0015);
  // Two elements across give Saint Venant's constant too high by a per cent or two; the ring mostly
  // bends.
  ExpectSeries(
      out_of_plane, 2, 3, [](int k) { return OutOfPlaneHz(k + 1); }, 0.005);
  // A turn by one cell maps the mesh onto itself, so pairs are degenerate but for rounding.
  ExpectPairs(in_plane, 3, 1e-8);
  ExpectPairs(out_of_plane, 3, 1e-8);
}

// A thin square plate whose edges are all free.

constexpr double kPlateSide = 0.2;
constexpr double kThickness = 0.002;

/// Coefficients omega a^2 sqrt(rho h / D) at a Poisson's ratio of 0.3, as Leissa tabulates them (J.
/// Sound Vib. 31, 1973): by Ritz' method with products of beam functions, so that they are upper
/// bounds, which such functions, bent at free edges otherwise than a plate, approach to one per
/// cent.
constexpr std::array<double, 6> kLeissa = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526};

TEST(Plate, HasTheFrequenciesOfLeissa) {
  const TetMesh mesh = MakeTetBox({kPlateSide, kPlateSide, kThickness}, {32, 32, 1}, 10);
  const double rigidity = kSteel.young_pa * std::pow(kThickness, 3) /
                          (12 * (1 - kSteel.poisson_ratio * kSteel.poisson_ratio));
  const double scale = std::sqrt(rigidity / (kSteelDensity * kThickness)) /
                       (kPlateSide * kPlateSide) / (2 * std::numbers::pi);
  const std::vector<double> found = FrequenciesHz(ModesOf(mesh, kSteel, kSteelDensity, 65 * scale));
  ASSERT_GE(found.size(), kLeissa.size());
  for (size_t m = 0; m < kLeissa.size(); ++m) {
    EXPECT_NEAR(found[m] / scale / kLeissa[m], 1, 0.012) << m;
    // Upper bounds of a thin plate; a thickness of a hundredth only lowers it.
    EXPECT_LT(found[m] / scale, kLeissa[m]) << m;
  }
  // The cells are cut along one diagonal of the square, which alone tells the two apart.
  EXPECT_NEAR(found[4] / found[3], 1, 2e-3);
}

}  // namespace
}  // namespace carillon::precompute
