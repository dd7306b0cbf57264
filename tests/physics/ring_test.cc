// SPDX-License-Identifier: Apache-2.0
//
// A thin free ring of square section: its bending in its plane and out of it.
#include <gtest/gtest.h>

#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

constexpr ElasticConstants kSteel{.young_pa = 210e9, .poisson_ratio = 0.3};
constexpr double kDensity = 7850;
constexpr double kRadius = 0.05;
constexpr double kSide = 0.002;

/// sqrt(E I / (rho A R^4)), 1/s
double Scale() { return std::sqrt(kSteel.young_pa / kDensity / 12) * kSide / (kRadius * kRadius); }

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

struct RingTest : ::testing::Test {
  static void SetUpTestSuite() {
    mesh = MakeTetTube({.outer_radius_m = kRadius + kSide / 2,
                        .wall_m = kSide,
                        .length_m = kSide,
                        .around = 72,
                        .along = 2,
                        .through = 2},
                       10);
    modes = ModesOf(mesh, kSteel, kDensity, 1.2 * InPlaneHz(4));
  }

  /// Frequencies of the modes of which more than half is, or is not, along the axis.
  static std::vector<double> Of(bool in_plane) {
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

  /// A turn by one cell maps the mesh onto itself, so pairs are degenerate but for rounding.
  static constexpr double kSplit = 1e-8;

  static inline TetMesh mesh;
  static inline DeformationModes modes;
};

TEST_F(RingTest, BendsInItsPlaneInPairsAsHoppeSays) {
  const std::vector<double> found = Of(true);
  ASSERT_GE(found.size(), 6u);
  for (int n = 2; n <= 4; ++n) {
    const auto first = static_cast<size_t>(2 * (n - 2));
    // Shear and rotary inertia cost the square of n times the thickness over the radius, 0.04; a
    // polygon of 72 sides is shorter around than the circle by 3e-4.
    EXPECT_NEAR(found[first] / InPlaneHz(n), 1, 0.0015) << n;
    EXPECT_NEAR(found[first + 1] / found[first], 1, kSplit) << n;
  }
}

TEST_F(RingTest, BendsOutOfItsPlaneInPairsAsMichellSays) {
  const std::vector<double> found = Of(false);
  ASSERT_GE(found.size(), 6u);
  for (int n = 2; n <= 4; ++n) {
    const auto first = static_cast<size_t>(2 * (n - 2));
    // Two elements across give Saint Venant's constant too high by a per cent or two; the ring
    // mostly bends.
    EXPECT_NEAR(found[first] / OutOfPlaneHz(n), 1, 0.005) << n;
    EXPECT_NEAR(found[first + 1] / found[first], 1, kSplit) << n;
  }
}

}  // namespace
}  // namespace carillon::precompute
