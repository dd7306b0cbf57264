// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/audible_modes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "precompute/mesh/boundary.h"
#include "tests/precompute/modes/unit_body.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pointwise;

/// A bar of unit material and `size` times its size, with all its modes up to the same one.
ModalModel Bar(double size) {
  const TetMesh mesh = MakeTetBox({size, 0.3 * size, 0.2 * size}, {8, 3, 2}, 4);
  return MakeModalModel(mesh, BoundarySurface(mesh), kUnitElastic,
                        ModesBelow(250 / (size * size), mesh));
}

/// Loudness at the beginning: each vertex struck along its normal with a unit impulse, averaged
/// over the area.
double LoudnessByStrikes(const ModalModel& model, size_t mode) {
  const size_t modes = model.eigenvalues.size();
  const double omega = std::sqrt(model.eigenvalues[mode]);
  double sum = 0;
  double area = 0;
  for (const auto& [a, b, c] : model.triangles) {
    const auto place = [&](int32_t vertex) {
      const auto& p = model.vertices[static_cast<size_t>(vertex)];
      return Eigen::Vector3d(p[0], p[1], p[2]);
    };
    const Eigen::Vector3d twice = (place(b) - place(a)).cross(place(c) - place(a));
    const Eigen::Vector3d normal = twice.normalized();
    for (const int32_t vertex : {a, b, c}) {
      double impulse = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        impulse += normal[static_cast<Eigen::Index>(axis)] *
                   double{model.shapes[(3 * static_cast<size_t>(vertex) + axis) * modes + mode]};
      }
      sum += twice.norm() / 6 * model.couplings[mode] * std::abs(impulse) / omega;
      area += twice.norm() / 6;
    }
  }
  return sum / area;
}

TEST(Audibility, IsTheMeanLoudnessOfStrikesAllOverTheSurface) {
  const ModalModel model = Bar(1);
  const std::vector<double> audibilities = Audibilities(model);
  ASSERT_GT(audibilities.size(), 20U);
  for (size_t m = 0; m < 20; ++m) {
    // Strikes at corners only take |n . phi| too large where it changes its sign on a triangle.
    EXPECT_NEAR(LoudnessByStrikes(model, m) / audibilities[m], 1, 0.3) << m;
  }
}

TEST(Audibility, RanksTheModesOfABodyAlikeInEverySize) {
  const std::vector<double> small = Audibilities(Bar(1));
  std::vector<double> large = Audibilities(Bar(10));
  // The integral as area over root of mass, squared, over the area: by 1 / size.
  for (double& audibility : large) audibility *= 10;
  EXPECT_THAT(large, Pointwise(DoubleNear(1e-4 * small[0]), small));
}

/// Three modes on one triangle, of which the second is the loudest and the first the least loud.
ModalModel ThreeModes() {
  ModalModel model;
  model.eigenvalues = {1, 4, 9};
  model.residuals = {0.1, 0.2, 0.3};
  model.couplings = {1, 20, 6};
  model.estimated_errors = {0.01, 0.02, 0.03};
  model.poisson_slopes = {-0.5, 0.5, 1.5};
  model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.triangles = {{0, 1, 2}};
  for (int row = 0; row < 9; ++row) {
    for (int m = 0; m < 3; ++m) model.shapes.push_back(static_cast<float>(10 * row + m));
  }
  return model;
}

TEST(KeepMostAudible, LeavesOutTheLeastAudibleAndSaysSo) {
  ModalModel model = ThreeModes();
  EXPECT_THAT(Audibilities(model), ElementsAre(2, 200, 8));
  KeepMostAudible(2, model);
  EXPECT_THAT(model.eigenvalues, ElementsAre(4, 9));
  EXPECT_THAT(model.residuals, ElementsAre(0.2, 0.3));
  EXPECT_THAT(model.couplings, ElementsAre(20, 6));
  EXPECT_THAT(model.estimated_errors, ElementsAre(0.02, 0.03));
  EXPECT_THAT(model.poisson_slopes, ElementsAre(0.5, 1.5));
  ASSERT_EQ(model.shapes.size(), 18U);
  EXPECT_EQ(model.shapes[0], 1);
  EXPECT_EQ(model.shapes[17], 82);
  EXPECT_EQ(model.left_out_mode_count, 1);
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_THAT(model.warnings[0],
              HasSubstr("of 3 modes the 2 most audible were kept and 1 left out: those kept go "
                        "down to 28.0 dB below the loudest, those left out begin at 40.0 dB"));
}

TEST(KeepMostAudible, LeavesAModelOfFewerModesAsItIs) {
  for (const int count : {0, 3, 10}) {
    ModalModel model = ThreeModes();
    KeepMostAudible(count, model);
    EXPECT_EQ(model.eigenvalues.size(), 3U);
    EXPECT_EQ(model.left_out_mode_count, 0);
    EXPECT_TRUE(model.warnings.empty());
  }
}

}  // namespace
}  // namespace carillon::precompute
