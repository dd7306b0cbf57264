// SPDX-License-Identifier: Apache-2.0
//
// A thin square plate whose edges are all free.
#include <gtest/gtest.h>

#include <array>

#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr double kSide = 0.2;
constexpr double kThickness = 0.002;

/// Coefficients omega a^2 sqrt(rho h / D) at a Poisson's ratio of 0.3, as Leissa tabulates them (J.
/// Sound Vib. 31, 1973): by Ritz' method with products of beam functions, so that they are upper
/// bounds, which such functions, bent at free edges otherwise than a plate, approach to one per
/// cent.
constexpr std::array<double, 6> kLeissa = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526};

TEST(Plate, HasTheFrequenciesOfLeissa) {
  const TetMesh mesh = MakeTetBox({kSide, kSide, kThickness}, {32, 32, 1}, 10);
  const double rigidity = kSteel.young_pa * std::pow(kThickness, 3) /
                          (12 * (1 - kSteel.poisson_ratio * kSteel.poisson_ratio));
  const double scale =
      std::sqrt(rigidity / (kSteelDensity * kThickness)) / (kSide * kSide) / (2 * std::numbers::pi);
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
